// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/tile_kernels.h"
#include "renderer/kernel/raymarch.h"

namespace scolopax {

template TileFunction chooseTileFunction<kernel::RayMarch<kernel::EqualSteps>>(const Scene&);
template TileFunction chooseTileFunction<kernel::RayMarch<kernel::VoxelCells>>(const Scene&);

}  // namespace scolopax
