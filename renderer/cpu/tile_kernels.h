// SPDX-License-Identifier: Apache-2.0
// Kernels over a tile of pixels, instantiated for every combination that a scene can use. Included by the
// files that compile the instances of an integrator.
#pragma once
#include <algorithm>

#include "renderer/cpu/tile_function.h"
#include "renderer/data/instances.h"
#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/render_pixel.h"
#include "renderer/kernel/shade.h"

namespace scolopax {

template <class Integrator, class Blend, class Lighting>
void renderTile(const Pass& pass, int tileX, int tileY) {
  const kernel::RenderPixel<Integrator, Blend, Lighting> render{pass.scene, pass.number, pass.pixels,
                                                                pass.cost, pass.first};
  const int endX = std::min((tileX + 1) * kTile, pass.scene.width);
  const int endY = std::min((tileY + 1) * kTile, pass.scene.height);
  for (int y = tileY * kTile; y < endY; ++y) {
    // The clock is read once per row: reading it costs about a tenth of a ray.
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
  return visitBlendAndLight(scene, [](auto blend, auto lighting) -> TileFunction {
    return renderTile<Integrator, typename decltype(blend)::type, typename decltype(lighting)::type>;
  });
}

}  // namespace scolopax
