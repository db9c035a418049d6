// SPDX-License-Identifier: Apache-2.0
// Functions that render one sample of every pixel of a tile. The CPU launcher calls them; kernels implement
// them.
#pragma once
#include "renderer/data/instances.h"
#include "renderer/launcher.h"

namespace scolopax {

/// Side of a tile, in pixels. Neighbouring rays share voxels and macrocells.
inline constexpr int kTile = 16;

/// Renders tile (tileX, tileY) of a pass, counted in tiles.
using TileFunction = void (*)(const Pass&, int tileX, int tileY);

/// The tile function of one integrator for a pass. Each integrator is compiled in a file of its own,
/// kernels_*.cpp.
template <class Integrator>
TileFunction chooseTileFunction(const Instance& instance);

}  // namespace scolopax
