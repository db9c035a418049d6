// SPDX-License-Identifier: Apache-2.0
// Kernels over a tile of pixels, one instance for every combination that a scene can ask for. An integrator's
// instances are compiled in a file of their own, kernels_*.cpp.
#pragma once
#include <algorithm>
#include <atomic>
#include <chrono>

#include "renderer/data/instances.h"
#include "renderer/kernel/render_pixel.h"

namespace scolopax {

/// One sample of every pixel; pixels and cost as in kernel::RenderPixel.
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

template <class Integrator, class Blend, class Features>
void renderTile(const Pass& pass, int tileX, int tileY) {
  const kernel::RenderPixel<Integrator, Blend, Features> render{pass.scene, pass.number, pass.pixels,
                                                                pass.cost, pass.first};
  const int endX = std::min((tileX + 1) * kTile, pass.scene.width);
  const int endY = std::min((tileY + 1) * kTile, pass.scene.height);
  for (int y = tileY * kTile; y < endY; ++y) {
    // The clock is looked at once a row: it costs about a tenth of a ray.
    if (std::chrono::steady_clock::now() >= pass.deadline) return;
    for (int x = tileX * kTile; x < endX; ++x) {
      const int pixel = y * pass.scene.width + x;
      if (pass.done[pixel]) continue;
      if (pass.cancel->load(std::memory_order_relaxed)) return;
      render(pixel);
      pass.done[pixel] = 1;
    }
  }
}

template <class Integrator>
TileFunction chooseTileFunction(const Scene& scene) {
  return visitBlendAndLight(scene, [](auto blend, auto features) -> TileFunction {
    return renderTile<Integrator, decltype(blend), decltype(features)>;
  });
}

extern template TileFunction chooseTileFunction<kernel::Analog<kernel::Superposed>>(const Scene&);
extern template TileFunction chooseTileFunction<kernel::Analog<kernel::Cumulative>>(const Scene&);
extern template TileFunction chooseTileFunction<kernel::Analog<kernel::SyncDda>>(const Scene&);
extern template TileFunction chooseTileFunction<kernel::Analog<kernel::NDda>>(const Scene&);
extern template TileFunction chooseTileFunction<kernel::RayMarch>(const Scene&);

}  // namespace scolopax
