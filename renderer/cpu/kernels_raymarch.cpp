// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/tile_kernels.h"
#include "renderer/kernel/raymarch.h"

namespace scolopax {

template TileFunction chooseTileFunction<kernel::RayMarch<kernel::EqualSteps>>(const Instance&);
template TileFunction chooseTileFunction<kernel::RayMarch<kernel::VoxelCells>>(const Instance&);

}  // namespace scolopax
