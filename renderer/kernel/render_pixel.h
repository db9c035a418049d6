// SPDX-License-Identifier: Apache-2.0
// One sample of one pixel. Launchers run it for every pixel of a pass; the engine adds the pass to the film.
#pragma once
#include <glm/vec4.hpp>

#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/sample_records.h"

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

  SCOLOPAX_HD void operator()(int pixel) const { (*this)(pixel, pixel); }
  /// `at`: the pixel's index in the arrays, which may be those of a part of the picture.
  SCOLOPAX_HD void operator()(int pixel, int at) const {
    Sampler sampler(std::uint32_t(pixel), number, scene.seed);
    const PixelRay<One> through =
        rayThrough<One>(scene, pixel % scene.width, pixel / scene.width, sampler, true);
    FirstCollision* const collisions = kPlainDevice ? nullptr : first;
    SampleCost spent;
    glm::vec4 result(0.0f);
    FirstCollision met;
    if (scene.channelCount > 0 && through.inside.enter < through.inside.exit)
      result = Integrator::template sample<Blend, Lighting>(scene, through.ray, through.inside, sampler,
                                                            &spent, collisions ? &met : nullptr);
    if (scene.isCancelled()) return;
    pass[at] = result;
    if (collisions) collisions[at] = {scene.rays.depth(through.x, through.y, met.depth), met.channel};
    if (cost) {
      spent.randomBlocks += sampler.blocks();
      addCost(&cost[at], spent);
    }
  }
};

}  // namespace scolopax::kernel
