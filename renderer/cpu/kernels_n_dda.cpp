// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/tile_kernels.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/trackers/process_per_channel.h"

namespace scolopax {

template TileFunction chooseTileFunction<kernel::Analog<kernel::NDda>>(const Instance&);

}  // namespace scolopax
