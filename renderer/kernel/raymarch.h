// SPDX-License-Identifier: Apache-2.0
// Deterministic quadrature along a ray, the paper's baseline (5.2-5.3): equal steps from a jittered start,
// empty macrocells skipped, opacity corrected for the step. Biased; converges as the step goes to 0.
#pragma once
#include "renderer/kernel/shade.h"

namespace scolopax::kernel {

/// Transmittance below which what lies behind no longer shows, not even in float pictures of high contrast.
inline constexpr float kOpaqueTransmittance = 1e-4f;
/// Steps after which a ray gives up and counts as truncated.
inline constexpr int kMaxMarchSteps = 1 << 20;

/// Calls visit(point, t) at t = inside.enter + (k + offset) * step for every whole k >= 0 inside a macrocell
/// whose bound is positive, front to back, until visit returns false. `bound`: 0 is that of all channels, 1 +
/// n channel n's.
template <class Visit>
SCOLOPAX_HD void march(const SceneView& scene, const Ray& ray, Interval inside, float offset, int bound,
                       SampleCost* cost, Visit&& visit) {
  const float step = scene.step;
  CellWalk walk(ray, inside, scene.majorants);
  int k = 0;  // of the next sample; whole numbers above 2^24 are not all floats, and a loop must advance
  const auto at = [&](int sample) { return inside.enter + (float(sample) + offset) * step; };
  int steps = 0;
  do {
    ++cost->cellSteps;
    const std::size_t cell = walk.index();
    if (!((bound == 0 ? scene.majorants.total(cell) : scene.majorants.bound(cell, bound - 1)) > 0.0f))
      continue;
    // First sample in the cell. Rounding may put the guess too low, which two steps mend; a sample is never
    // taken twice, because k only grows.
    const int guess = int(clamp((walk.enter() - inside.enter) / step - offset, 0.0f, 1e9f));
    if (guess > k) k = guess;
    for (int mend = 0; mend < 2 && at(k) < walk.enter(); ++mend) ++k;
    for (; at(k) < walk.exit(); ++k) {
      if (++steps > kMaxMarchSteps) {
        cost->truncated = 1;
        return;
      }
      const float t = at(k);
      if (!visit(walk.pointAt(t), t)) return;
    }
  } while (walk.advance());
}

/// Transmittance of a shadow ray; in separate blend modes, of one channel.
template <class Blend>
SCOLOPAX_HD float marchTransmittance(const SceneView& scene, const Ray& ray, Interval inside, int channel,
                                     float offset, SampleCost* cost) {
  float depth = 0.0f;
  march(scene, ray, inside, offset, Blend::kSeparate ? 1 + channel : 0, cost, [&](glm::vec3 point, float) {
    if constexpr (Blend::kSeparate) {
      depth += classify(scene, channel, point, cost).extinction * scene.step;
    } else if constexpr (Blend::kSums) {
      for (int n = 0; n < scene.channelCount; ++n)
        depth += classify(scene, n, point, cost).extinction * scene.step;
    } else {
      depth += largestOf(scene, point, cost).extinction * scene.step;
    }
    return depth < 16.0f;
  });
  return 1.0f - absorbed(depth);
}

/// The channel that a collision at a point happens in; `pick` in [0,1) decides where extinctions add up.
template <class Blend>
SCOLOPAX_HD int channelAt(const SceneView& scene, glm::vec3 point, float pick, float extinction) {
  SampleCost uncounted;
  if constexpr (!Blend::kSums) return largestOf(scene, point, &uncounted).channel;
  float left = pick * extinction;
  int n = 0;
  while (n + 1 < scene.channelCount) {
    left -= classify(scene, n, point, &uncounted).extinction;
    if (left < 0.0f) break;
    ++n;
  }
  return n;
}

/// Premultiplied RGBA of a ray; `only` >= 0 marches that channel alone.
template <class Blend, class Features>
SCOLOPAX_HD glm::vec4 marchRay(const SceneView& scene, const Ray& ray, Interval inside, int only,
                               Sampler& sampler, SampleCost* cost, FirstCollision* first) {
  glm::vec3 color(0.0f);
  float transmittance = 1.0f, opacity = 0.0f;  // both: 1 - transmittance would lose what is thin
  const RandomBlock random = sampler.next();
  const float offset = uniformOf(random.x);
  // A tracker's ray would end where the opacity passes this number.
  const float end = first ? uniformOf(random.y) : kInfinity;
  bool ended = false;
  march(scene, ray, inside, offset, 1 + only, cost, [&](glm::vec3 point, float t) {
    const Collision here{{t, 0.0f}, point, only, 0.0f};
    Visibility visibility;
    bool visible = false;  // whether `visibility` was worked out: only where there is something to light
    const auto show = [&](int n, float position) {
      const ChannelView& channel = scene.channels[n];
      const glm::vec3 emitted = evaluate(channel.color, position);
      if constexpr (Features::kAny) {
        if (!visible) {
          visibility = visibilityAt<Features>(scene, ray, here, [&](const Ray& shadowRay, Interval part) {
            return marchTransmittance<Blend>(scene, shadowRay, part, only, uniformOf(sampler.next().x), cost);
          });
          visible = true;
        }
        return lit<Features>(scene, channel, emitted, ray, here, visibility, cost);
      }
      return emitted;
    };
    float extinction = 0.0f;
    glm::vec3 emission(0.0f);  // extinction times radiance
    if constexpr (!Blend::kSums && !Blend::kMixes) {
      const Largest largest = largestOf(scene, point, cost);
      extinction = largest.extinction;
      if (extinction > 0.0f) emission = extinction * show(largest.channel, largest.position);
    } else {
      for (int n = only < 0 ? 0 : only; n < (only < 0 ? scene.channelCount : only + 1); ++n) {
        const Classified c = classify(scene, n, point, cost);
        if (!(c.extinction > 0.0f)) continue;
        extinction = Blend::kMixes ? maximum(extinction, c.extinction) : extinction + c.extinction;
        emission += show(n, c.position) * (c.extinction * (Blend::kMixes ? scene.channels[n].weight : 1.0f));
      }
    }
    if (extinction > 0.0f) {
      const float alpha = absorbed(extinction * scene.step);
      const float absorbedHere = transmittance * alpha;
      color += emission * (absorbedHere / extinction);
      const float before = opacity;
      opacity += absorbedHere;
      transmittance *= 1.0f - alpha;
      if (!ended && opacity > end) {
        ended = true;
        const float pick = (end - before) / absorbedHere;
        keepNearer(first, {t, only < 0 ? channelAt<Blend>(scene, point, pick, extinction) : only});
      }
    }
    return transmittance > kOpaqueTransmittance;
  });
  return glm::vec4(color, minimum(opacity, 1.0f));
}

struct RayMarch {
  template <class Blend, class Features>
  SCOLOPAX_HD static glm::vec4 sample(const SceneView& scene, const Ray& ray, Interval inside,
                                      Sampler& sampler, SampleCost* cost, FirstCollision* first) {
    if constexpr (Blend::kSeparate) {
      glm::vec3 color(0.0f);
      float opacity = 0.0f;
      for (int n = 0; n < scene.channelCount; ++n) {
        const glm::vec4 alone = marchRay<Blend, Features>(scene, ray, inside, n, sampler, cost, first);
        color += glm::vec3(alone);
        opacity += (1.0f - opacity) * alone.w;
      }
      return glm::vec4(color, opacity);
    } else {
      return marchRay<Blend, Features>(scene, ray, inside, -1, sampler, cost, first);
    }
  }
};

}  // namespace scolopax::kernel
