// SPDX-License-Identifier: Apache-2.0
// Quadrature along a ray: equal segments from a jittered start, over each of which the scalars are linear and
// the curves exact (the paper's baseline of 5.2-5.3 takes one point instead). Lighting is worked out once for
// every stratum of absorbed light. Biased; of order 2 in the step.
#pragma once
#include "renderer/kernel/strata.h"

namespace scolopax::kernel {

/// Transmittance below which what lies behind no longer shows, not even in float pictures of high contrast.
inline constexpr float kOpaqueTransmittance = 1e-4f;

/// The channel that a collision on a segment happens in; `pick` in [0,1) decides where extinctions add up.
template <class Blend>
SCOLOPAX_HD int channelOf(const SegmentParts<Blend>& parts, float extinction, float pick) {
  float left = pick * extinction, most = -1.0f;
  int channel = 0;
  bool found = false;
  parts.visit([&](int n, const Part& part) {
    if (Blend::kMixes ? part.opacity > most : !found) channel = n, most = part.opacity;
    left -= part.opacity;
    found = found || left < 0.0f;
  });
  return channel;
}

/// Premultiplied RGBA of a ray; `only` >= 0 marches that channel alone.
template <class Blend, class Features>
SCOLOPAX_HD glm::vec4 marchRay(const SceneView& scene, const Ray& ray, Interval inside, int only,
                               Sampler& sampler, Sampler& ofStrata, SampleCost* cost, FirstCollision* first) {
  glm::vec3 color(0.0f);
  float transmittance = 1.0f, opacity = 0.0f;  // both: 1 - transmittance would lose what is thin
  const RandomBlock random = sampler.next();
  // A tracker's ray would end where the opacity passes this number.
  const float end = first ? uniformOf(random.y) : kInfinity;
  bool ended = false;
  [[maybe_unused]] StratumChannels channels;
  [[maybe_unused]] Strata<Blend, Features> strata(channels, scene, ray, only, ofStrata, cost);
  SegmentRun run;
  LargestsOf<Blend> largests;
  SegmentWalk walk(run, scene, ray, inside, only, uniformOf(random.x), scene.step, cost);
  for (bool more = true; more;) {
    more = walk.next();
    const float length = walk.length(), before = opacity;
    const SegmentParts<Blend> parts(largests, scene, walk);
    glm::vec3 emission(0.0f);
    const float extinction = parts.visit([&](int, const Part& part) { emission += part.emission; });
    if (extinction > 0.0f) {
      const float alpha = absorbed(extinction * length);
      const float absorbedHere = transmittance * alpha;
      opacity += absorbedHere;
      transmittance *= 1.0f - alpha;
      more = more && transmittance > kOpaqueTransmittance;
      emission *= absorbedHere / extinction;
      if constexpr (!Features::kAny) color += emission;
      if (!ended && opacity > end) {
        ended = true;
        const float pick = (end - before) / absorbedHere;
        keepNearer(first,
                   {walk.start() + pick * length, only < 0 ? channelOf(parts, extinction, pick) : only});
      }
    } else if (more) {
      continue;
    }
    if constexpr (Features::kAny)
      strata.absorb(before, opacity, !more, {walk.start(), length, extinction}, parts, emission, color);
  }
  return glm::vec4(color, minimum(opacity, 1.0f));
}

struct RayMarch {
  template <class Blend, class Features>
  SCOLOPAX_HD static glm::vec4 sample(const SceneView& scene, const Ray& ray, Interval inside,
                                      Sampler& sampler, SampleCost* cost, FirstCollision* first) {
    Sampler ofStrata = sampler.aside();  // one for all channels: their draws are independent
    if constexpr (Blend::kSeparate) {
      glm::vec3 color(0.0f);
      float opacity = 0.0f;
      for (int n = 0; n < scene.channelCount; ++n) {
        const glm::vec4 alone =
            marchRay<Blend, Features>(scene, ray, inside, n, sampler, ofStrata, cost, first);
        color += glm::vec3(alone);
        opacity += (1.0f - opacity) * alone.w;
      }
      return glm::vec4(color, opacity);
    } else {
      return marchRay<Blend, Features>(scene, ray, inside, -1, sampler, ofStrata, cost, first);
    }
  }
};

}  // namespace scolopax::kernel
