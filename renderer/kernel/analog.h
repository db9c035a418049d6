// SPDX-License-Identifier: Apache-2.0
// A sample by analog tracking: the ray ends at its first collision and has the lit colour there. With every
// tracker its expected value is the exact picture, whatever the lighting.
#pragma once
#include "renderer/kernel/shade.h"

namespace scolopax::kernel {

/// The first collision that track(span) finds in the spans of a ray in which some of `channels` (bit n:
/// visible channel n) are not clipped.
template <class Track>
SCOLOPAX_HD std::optional<Collision> firstInSpans(const SceneView& scene, const Ray& ray, Interval inside,
                                                  std::uint32_t channels, Track&& track) {
  Spans<One> spans(scene, ray, inside, channels);
  std::optional<Collision> hit;
  do {
    const Interval span = spans.next(true);
    if (span.enter < span.exit) hit = track(span);
  } while (!hit && !spans.done(true));
  return hit;
}
/// The first collision with any channel.
template <class Tracker, class Blend, class View>
SCOLOPAX_HD std::optional<Collision> trackAll(const View& scene, const Ray& ray, Interval inside,
                                              Sampler& sampler, SampleCost* cost) {
  return firstInSpans(scene, ray, inside, ~0u, [&](Interval span) {
    return Tracker::template track<Blend>(scene, ray, span, sampler, cost);
  });
}
/// The first collision with channel n, as if it were the only channel.
template <class Blend, class View>
SCOLOPAX_HD std::optional<Collision> trackAlone(const View& scene, int n, const Ray& ray, Interval inside,
                                                Sampler& sampler, SampleCost* cost) {
  return firstInSpans(scene, ray, inside, 1u << n, [&](Interval span) {
    return trackChannel<Blend>(scene, n, {}, ray, span, sampler, cost);
  });
}

/// Whether a shadow ray has a collision; in separate blend modes, with the channel that cast it.
template <class Tracker, class Blend, class View>
SCOLOPAX_HD bool isBlocked(const View& scene, const Ray& ray, Interval inside, int channel, Sampler& sampler,
                           SampleCost* cost) {
  if constexpr (Blend::kSeparate) {
    return trackAlone<Blend>(scene, channel, ray, inside, sampler, cost).has_value();
  } else {
    return trackAll<Tracker, Blend>(scene, ray, inside, sampler, cost).has_value();
  }
}

/// The lit colour at a collision: that of its channel or, in mix, of all channels, each lit with its own
/// material before it is weighted (Eq. 10).
template <class Tracker, class Blend, class Features, class View>
SCOLOPAX_HD glm::vec3 radiance(const View& scene, const Ray& ray, const Collision& hit, Sampler& sampler,
                               SampleCost* cost) {
  const LitPoint<One> at{ray, hit.place.t(), insideOf<One>(scene.clip, hit.point)};
  Visibility<One> visibility;
  if constexpr (Features::kAny)
    visibility = visibilityAt<Features>(scene, at, true, [&](const Ray& shadowRay, Interval part) {
      return isBlocked<Tracker, Blend>(scene, shadowRay, part, hit.channel, sampler, cost) ? 0.0f : 1.0f;
    });
  const auto show = [&](const ChannelView& channel, float position) {
    const glm::vec3 color = evaluate(channel.color, position);
    if constexpr (Features::kAny) return lit<Features>(scene, channel, color, at, visibility, true, cost);
    return color;
  };
  if constexpr (Blend::kMixes) {
    glm::vec3 sum(0.0f);
    float largest = 0.0f;
    const std::uint32_t left =
        scene.clip.parts ? channelsAt<One>(scene.clip, hit.point) | 1u << hit.channel : ~0u;
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(left >> n & 1)) continue;
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

template <class Tracker>
struct Analog {
  /// Linear premultiplied RGBA of one sample along a ray. If there is a collision and `first` is not null,
  /// sets `first` to it.
  template <class Blend, class Features, class View>
  SCOLOPAX_HD static glm::vec4 sample(const View& scene, const Ray& ray, Interval inside, Sampler& sampler,
                                      SampleCost* cost, FirstCollision* first) {
    if constexpr (Blend::kSeparate) {
      // Channels draw independent numbers, so 1 - prod(1 - hit_n) has the expected value 1 - prod(1 -
      // alpha_n).
      glm::vec4 sum(0.0f);
      for (int n = 0; n < scene.channelCount; ++n) {
        const auto hit = trackAlone<Blend>(scene, n, ray, inside, sampler, cost);
        if (!hit) continue;
        if (first) keepNearer(first, {hit->place.t(), n});
        sum = glm::vec4(glm::vec3(sum) + radiance<Tracker, Blend, Features>(scene, ray, *hit, sampler, cost),
                        1.0f);
      }
      return sum;
    } else {
      const auto hit = trackAll<Tracker, Blend>(scene, ray, inside, sampler, cost);
      if (!hit) return glm::vec4(0.0f);
      if (first) *first = {hit->place.t(), hit->channel};
      return glm::vec4(radiance<Tracker, Blend, Features>(scene, ray, *hit, sampler, cost), 1.0f);
    }
  }
};

}  // namespace scolopax::kernel
