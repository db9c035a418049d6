// SPDX-License-Identifier: Apache-2.0
// One sample of one pixel: ray, tracker, colour. Launchers run it for every pixel and add the result to the
// film.
#pragma once
#include <glm/vec4.hpp>

#include "renderer/kernel/collision.h"

namespace scolopax::kernel {

/// Blend mode density: a collision shows the one channel it happened in (Eq. 6-7). Analog tracking draws the
/// channel with probability extinction_n / sum already, so there is nothing left to weigh.
struct BlendDensity {
  SCOLOPAX_HD static glm::vec3 radiance(const SceneView& scene, const Collision& collision) {
    return evaluate(scene.channels[collision.channel].color, collision.position);
  }
};

template <class Tracker, class Blend>
struct RenderPixel {
  SceneView scene;
  std::uint32_t sample;
  glm::vec4* pass;   ///< width x height: this sample's linear premultiplied RGBA
  SampleCost* cost;  ///< the same shape, or null where nobody counts

  SCOLOPAX_HD void operator()(int pixel) const {
    Sampler sampler(std::uint32_t(pixel), sample, scene.seed);
    const RandomBlock jitter = sampler.next();
    const float x = float(pixel % scene.width) + (scene.filterBox ? uniformOf(jitter.x) : 0.5f);
    const float y = float(pixel / scene.width) + (scene.filterBox ? uniformOf(jitter.y) : 0.5f);
    const Ray ray = scene.rays(x, y);
    const Interval inside = clipToBox(ray, scene.dims);

    SampleCost spent;
    glm::vec4 result(0.0f);
    if (scene.channelCount > 0 && inside.enter < inside.exit)
      if (const auto hit = Tracker::track(scene, ray, inside, sampler, &spent))
        result = glm::vec4(Blend::radiance(scene, *hit), 1.0f);
    pass[pixel] = result;
    if (cost) {
      spent.randomBlocks = sampler.blocks();
      cost[pixel].fetches += spent.fetches;
      cost[pixel].cellSteps += spent.cellSteps;
      cost[pixel].randomBlocks += spent.randomBlocks;
      cost[pixel].truncated += spent.truncated;
    }
  }
};

}  // namespace scolopax::kernel
