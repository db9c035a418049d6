// SPDX-License-Identifier: Apache-2.0
// One sample of one pixel: ray, collision, light. Launchers run it for every pixel and add the result to the
// film.
#pragma once
#include <glm/vec4.hpp>

#include "renderer/kernel/shade.h"

namespace scolopax::kernel {

/// What a collision shows: its channel, or in mix all of them, each lit with its own material before it is
/// weighted (Eq. 10).
template <class Tracker, class Blend, class Features>
SCOLOPAX_HD glm::vec3 radiance(const SceneView& scene, const Ray& ray, const Collision& hit, Sampler& sampler,
                               SampleCost* cost) {
  Visibility visibility;
  if constexpr (Features::kAny)
    visibility = visibilityAt<Tracker, Blend, Features>(scene, ray, hit, sampler, cost);
  const auto show = [&](const ChannelView& channel, float position) {
    const glm::vec3 color = evaluate(channel.color, position);
    if constexpr (Features::kAny) return lit<Features>(scene, channel, color, ray, hit, visibility, cost);
    return color;
  };
  if constexpr (Blend::kMixes) {
    glm::vec3 sum(0.0f);
    float largest = 0.0f;
    for (int n = 0; n < scene.channelCount; ++n) {
      const Classified c = classify(scene, n, hit.point, cost);
      if (!(c.extinction > 0.0f)) continue;
      largest = maximum(largest, c.extinction);
      sum += show(scene.channels[n], c.position) * (c.extinction * scene.channels[n].weight);
    }
    return sum * (1.0f / largest);
  } else {
    return show(scene.channels[hit.channel], hit.position);
  }
}

/// Linear premultiplied RGBA of one sample along a ray.
template <class Tracker, class Blend, class Features>
SCOLOPAX_HD glm::vec4 sampleRay(const SceneView& scene, const Ray& ray, Interval inside, Sampler& sampler,
                                SampleCost* cost) {
  if constexpr (Blend::kSeparate) {
    // Channels draw independent numbers, so 1 - prod(1 - hit_n) has the expected value 1 - prod(1 - alpha_n).
    glm::vec4 sum(0.0f);
    for (int n = 0; n < scene.channelCount; ++n) {
      std::optional<Collision> hit;
      trackChannel<Blend>(scene, n, ray, inside, sampler, &hit, cost);
      if (!hit) continue;
      const glm::vec3 color = radiance<Tracker, Blend, Features>(scene, ray, *hit, sampler, cost);
      sum = glm::vec4(sum.x + color.x, sum.y + color.y, sum.z + color.z, 1.0f);
    }
    return sum;
  } else {
    const auto hit = Tracker::template track<Blend>(scene, ray, inside, sampler, cost);
    if (!hit) return glm::vec4(0.0f);
    return glm::vec4(radiance<Tracker, Blend, Features>(scene, ray, *hit, sampler, cost), 1.0f);
  }
}

template <class Tracker, class Blend, class Features>
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
      result = sampleRay<Tracker, Blend, Features>(scene, ray, inside, sampler, &spent);
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
