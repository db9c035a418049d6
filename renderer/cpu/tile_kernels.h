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
  using Clock = std::chrono::steady_clock;
  // Reading the clock costs about a tenth of a ray, so it is read once per row if rows take no longer than
  // this.
  constexpr std::chrono::milliseconds kSlow{1};
  bool slow = true;
  for (int y = tileY * kTile; y < endY; ++y) {
    const Clock::time_point begin = Clock::now();
    if (begin >= pass.deadline) return;
    for (int x = tileX * kTile; x < endX; ++x) {
      const int pixel = y * pass.scene.width + x;
      if (pass.done[pixel]) continue;
      if (slow && Clock::now() >= pass.deadline) return;
      render(pixel);
      if (pass.scene.isCancelled()) return;
      pass.done[pixel] = 1;
    }
    slow = Clock::now() - begin > kSlow;
  }
}

template <class Integrator>
TileFunction chooseTileFunction(const Instance& instance) {
  return visitBlendAndLight(instance, [](auto blend, auto lighting) -> TileFunction {
    return renderTile<Integrator, typename decltype(blend)::type, typename decltype(lighting)::type>;
  });
}

}  // namespace scolopax
