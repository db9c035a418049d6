// SPDX-License-Identifier: Apache-2.0
// One sample of one pixel. Launchers run it for every pixel of a pass; the engine adds the pass to the film.
#pragma once
#include <glm/vec4.hpp>

#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/rng.h"

namespace scolopax::kernel {

/// One ray per lane through its pixel, and the part of it inside the clipped volume.
template <class L>
struct PixelRay {
  typename L::Float x, y;  ///< on the film, in pixels
  RayOf<L> ray;
  IntervalOf<L> inside;
};
/// Draws one block of random numbers, for lanes in `which`.
template <class L>
SCOLOPAX_LANES PixelRay<L> rayThrough(const SceneView& scene, typename L::Int column, typename L::Int row,
                                      SamplerOf<L>& sampler, typename L::Mask which) {
  const auto jitter = sampler.next(which);
  const auto x = toFloat(column) + 0.5f + scene.filterWidth * (uniformOf(jitter.x) - 0.5f);
  const auto y = toFloat(row) + 0.5f + scene.filterWidth * (uniformOf(jitter.y) - 0.5f);
  const RayOf<L> ray = scene.rays.through<L>(x, y);
  return {x, y, ray, clipToScene(scene, ray)};
}

/// Integrator: Analog<Tracker> or RayMarch.
template <class Integrator, class Blend, class Lighting, class View = SceneView>
struct RenderPixel {
  View scene;
  SampleNumber number;
  glm::vec4* pass;                  ///< width x height: this sample's linear premultiplied RGBA
  SampleCost* cost;                 ///< the same shape, or null if costs are not counted
  FirstCollision* first = nullptr;  ///< the same shape, or null if it is not needed

  SCOLOPAX_HD void operator()(int pixel) const {
    Sampler sampler(std::uint32_t(pixel), number, scene.seed);
    const PixelRay<One> at = rayThrough<One>(scene, pixel % scene.width, pixel / scene.width, sampler, true);
#if defined(__CUDA_ARCH__)
    constexpr FirstCollision* const first = nullptr;  // devices do not record it, and need not compile it
#endif
    SampleCost spent;
    glm::vec4 result(0.0f);
    FirstCollision met;
    if (scene.channelCount > 0 && at.inside.enter < at.inside.exit)
      result = Integrator::template sample<Blend, Lighting>(scene, at.ray, at.inside, sampler, &spent,
                                                            first ? &met : nullptr);
    if (scene.isCancelled()) return;
    pass[pixel] = result;
    if (first) first[pixel] = {scene.rays.depth(at.x, at.y, met.depth), met.channel};
    if (cost) {
      spent.randomBlocks += sampler.blocks();
      cost[pixel].fetches += spent.fetches;
      cost[pixel].cellSteps += spent.cellSteps;
      cost[pixel].randomBlocks += spent.randomBlocks;
      cost[pixel].truncated += spent.truncated;
    }
  }
};

}  // namespace scolopax::kernel
