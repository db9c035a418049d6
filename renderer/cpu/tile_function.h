// SPDX-License-Identifier: Apache-2.0
// One sample of every pixel, in tiles: what the CPU's launcher asks of its kernels.
#pragma once
#include "renderer/launcher.h"

namespace scolopax {

/// Neighbouring rays share voxels and macrocells.
inline constexpr int kTile = 16;

/// Renders the tile at (tileX, tileY), in tiles.
using TileFunction = void (*)(const Pass&, int tileX, int tileY);

/// The kernels of one integrator, each in a file of its own, kernels_*.cpp.
template <class Integrator>
TileFunction chooseTileFunction(const Scene& scene);

}  // namespace scolopax
