// SPDX-License-Identifier: Apache-2.0
// A sample by analog tracking: the ray ends at its first collision and has the lit colour there. Its expected
// value is the exact picture, with every tracker and in any light.
#pragma once
#include "renderer/kernel/sample_records.h"
#include "renderer/kernel/shade.h"
#include "renderer/kernel/surfaces.h"
#include "renderer/kernel/trackers/process_per_channel.h"

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

/// The surface of one of `channels` (bit n: visible channel n) at which a ray ends if it has no collision
/// before.
template <class View>
SCOLOPAX_HD std::optional<SurfaceHit<One>> endingSurface(const View& scene, const Ray& ray,
                                                         const Interval& inside, std::uint32_t channels,
                                                         const SurfaceStart<One>& start, Sampler& sampler,
                                                         SampleCost* cost) {
  if (!scene.hasSurfaces()) [[likely]]
    return std::nullopt;
  return endAtSurface(scene, ray, inside, channels, start, uniformOf(sampler.next().x), cost);
}

/// Whether a shadow ray has a collision or ends at a surface; in separate blend modes, of the channel that
/// cast it. `start`: the surface at which it begins.
template <class Tracker, class Blend, class View>
SCOLOPAX_HD bool isBlocked(const View& scene, const Ray& ray, Interval inside, int channel,
                           const SurfaceStart<One>& start, Sampler& sampler, SampleCost* cost) {
  const std::uint32_t channels = Blend::kSeparate ? 1u << channel : ~0u;
  if (endingSurface(scene, ray, inside, channels, start, sampler, cost)) return true;
  if constexpr (Blend::kSeparate) {
    return trackAlone<Blend>(scene, channel, ray, inside, sampler, cost).has_value();
  } else {
    return trackAll<Tracker, Blend>(scene, ray, inside, sampler, cost).has_value();
  }
}

/// The lit colour at a collision: that of its channel or, in mix, of all channels, each lit with its own
/// material before it is weighted (Eq. 10). If the ray ends at `surface` instead, which may be null, the lit
/// colour of that.
template <class Tracker, class Blend, class Lighting, class View>
SCOLOPAX_HD glm::vec3 radiance(const View& scene, const Ray& ray, const Collision& hit,
                               const SurfaceHit<One>* surface, Sampler& sampler, SampleCost* cost) {
  const bool onSurface = surface != nullptr;
  const LitPoint<One> at{ray, hit.distance.t(), insideOf<One>(scene.clip, hit.point)};
  Visibility<One> visibility;
  if constexpr (Lighting::kAny)
    visibility = visibilityAt(scene, at, true, [&](const Ray& shadowRay, Interval part) {
      const SurfaceStart<One> start = onSurface ? surface->surface : SurfaceStart<One>{};
      return isBlocked<Tracker, Blend>(scene, shadowRay, part, hit.channel, start, sampler, cost) ? 0.0f
                                                                                                  : 1.0f;
    });
  const auto show = [&](const ChannelView& channel, float position) {
    const glm::vec3 color = onSurface ? surface->color : evaluate(channel.color, position);
    if constexpr (Lighting::kAny) return lit(scene, channel, color, at, visibility, true, onSurface, cost);
    return color;
  };
  if (Blend::kMixes && !onSurface) {
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
  /// Linear premultiplied RGBA of one sample along a ray. If it ends at a collision or surface and `first` is
  /// not null, sets `first` to it.
  template <class Blend, class Lighting, class View>
  SCOLOPAX_HD static glm::vec4 sample(const View& scene, const Ray& ray, Interval inside, Sampler& sampler,
                                      SampleCost* cost, FirstCollision* first) {
    const auto follow = [&](std::uint32_t channels, auto&& track, glm::vec4* sum) {
      const auto surface = endingSurface(scene, ray, inside, channels, {}, sampler, cost);
      Interval before = inside;
      if (surface) [[unlikely]]
        before.exit = minimum(before.exit, surface->t);
      std::optional<Collision> hit = track(before);
      const SurfaceHit<One>* ending = nullptr;
      if (!hit) {
        if (!surface) [[likely]]
          return;
        ending = &*surface;
        hit = Collision{
            {surface->t, 0.0f}, ray.origin + surface->t * ray.direction, surface->surface.channel, 0.0f};
      }
      if (first) keepNearer(first, true, hit->distance.t(), hit->channel);
      const glm::vec3 color = radiance<Tracker, Blend, Lighting>(scene, ray, *hit, ending, sampler, cost);
      *sum = glm::vec4(glm::vec3(*sum) + color, 1.0f);
    };
    glm::vec4 sum(0.0f);
    if constexpr (Blend::kSeparate) {
      // Channels draw independent numbers, so 1 - prod(1 - hit_n) has the expected value 1 - prod(1 -
      // alpha_n).
      for (int n = 0; n < scene.channelCount; ++n)
        follow(
            1u << n,
            [&](const Interval& before) { return trackAlone<Blend>(scene, n, ray, before, sampler, cost); },
            &sum);
    } else {
      follow(
          ~0u,
          [&](const Interval& before) { return trackAll<Tracker, Blend>(scene, ray, before, sampler, cost); },
          &sum);
    }
    return sum;
  }
};

}  // namespace scolopax::kernel
