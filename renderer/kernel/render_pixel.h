// SPDX-License-Identifier: Apache-2.0
// One sample of one pixel. Launchers run it for every pixel and add the result to the
// film.
#pragma once
#include <glm/vec4.hpp>

#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/rng.h"

namespace scolopax::kernel {

/// Integrator: Analog<Tracker> or RayMarch.
template <class Integrator, class Blend, class Features>
struct RenderPixel {
  SceneView scene;
  SampleNumber number;
  glm::vec4* pass;                  ///< width x height: this sample's linear premultiplied RGBA
  SampleCost* cost;                 ///< the same shape, or null where nobody counts
  FirstCollision* first = nullptr;  ///< the same shape, or null where nobody asks

  SCOLOPAX_HD void operator()(int pixel) const {
    Sampler sampler(std::uint32_t(pixel), number, scene.seed);
    const RandomBlock jitter = sampler.next();
    const int column = pixel % scene.width, row = pixel / scene.width;
    const float x = float(column) + (scene.filterBox ? uniformOf(jitter.x) : 0.5f);
    const float y = float(row) + (scene.filterBox ? uniformOf(jitter.y) : 0.5f);
    const Ray ray = scene.rays(x, y);
    const Interval inside = clipToScene(scene, ray);

#if defined(__CUDA_ARCH__)
    constexpr FirstCollision* const first = nullptr;  // devices are not asked, and need not compile it
#endif
    SampleCost spent;
    glm::vec4 result(0.0f);
    FirstCollision met;
    if (scene.channelCount > 0 && inside.enter < inside.exit)
      result = Integrator::template sample<Blend, Features>(scene, ray, inside, sampler, &spent,
                                                            first ? &met : nullptr);
    pass[pixel] = result;
    if (first) first[pixel] = {scene.rays.depth(x, y, met.depth), met.channel};
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
