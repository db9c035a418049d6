// SPDX-License-Identifier: Apache-2.0
// One sample of every pixel, in tiles: what the CPU backend asks of its kernels.
#pragma once
#include <atomic>
#include <chrono>
#include <glm/vec4.hpp>

#include "renderer/data/scene.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// Pixels, cost and first as in kernel::RenderPixel.
struct Pass {
  kernel::SceneView scene;
  kernel::SampleNumber number;
  glm::vec4* pixels;
  kernel::SampleCost* cost;
  kernel::FirstCollision* first;
  std::uint8_t* done;  ///< width x height: pixels of this pass that are rendered; the others are still to do
  const std::atomic<bool>* cancel;
  std::chrono::steady_clock::time_point deadline;
};

/// Neighbouring rays share voxels and macrocells.
inline constexpr int kTile = 16;

/// Renders the tile at (tileX, tileY), in tiles.
using TileFunction = void (*)(const Pass&, int tileX, int tileY);

/// The kernels of one integrator, each in a file of its own, kernels_*.cpp.
template <class Integrator>
TileFunction chooseTileFunction(const Scene& scene);

}  // namespace scolopax
