// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/tile_kernels.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/trackers/one_process.h"

namespace scolopax {

template TileFunction chooseTileFunction<kernel::Analog<kernel::Superposed>>(const Instance&);

}  // namespace scolopax
