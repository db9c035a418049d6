// SPDX-License-Identifier: Apache-2.0
// Tracking with a Poisson process per channel, by the paper's two methods: n-dda walks the macrocells once
// per channel, sync-dda once for all channels. The nearest accepted collision wins.
#pragma once
#include "renderer/kernel/trackers/close_look.h"

namespace scolopax::kernel {

/// Tracks channel n, if it is one of `channels`, through the walk's current cell, but not beyond `*nearest`.
/// A hit replaces `*nearest`.
template <bool kClosely, class Blend, class Channels, class View>
SCOLOPAX_HD CellOutcome trackCell(const View& scene, Channels channels, int n,
                                  [[maybe_unused]] const Ray& ray, const CellWalk& walk, Sampler& sampler,
                                  std::optional<Collision>* nearest, std::uint32_t* tentative,
                                  SampleCost* cost) {
  if (!channels.has(n)) return CellOutcome::nothing;
  const float bound = scene.majorants.bound(walk.index(), n);
  if (!(bound > 0.0f)) return CellOutcome::nothing;
  const float total = bound * (walk.exit() - walk.enter());
  float passed = 0.0f;
  for (std::uint32_t limit = patienceAfter(*tentative);;) {
    RandomBlock random = sampler.next();
    passed += opticalDepth(uniformOf(random.x));
    // The cell's end comes first: a step that leaves a thin cell says nothing about what lies behind it, even
    // if it overshoots the nearest collision so far. (Listing 3 prints the opposite order, and loses
    // collisions.)
    if (!(passed < total)) return CellOutcome::nothing;
    const RayDistance distance{walk.enter(), passed / bound};
    if (*nearest && !nearer(distance, (*nearest)->distance)) return CellOutcome::nothing;
    if (const auto hit = testChannel<Blend>(scene, channels, n, bound, distance, walk.pointAt(distance.t()),
                                            random, cost)) {
      *nearest = hit;
      return CellOutcome::hit;
    }
    if (++*tentative < limit) continue;
    if (*tentative >= kMaxTentativeCollisions || scene.isCancelled()) return CellOutcome::exhausted;
    limit = patienceAfter(*tentative);
    if (!(total - passed > kManyCollisions)) continue;
    if constexpr (!kClosely) {
      return CellOutcome::stuck;
    } else {
      random = sampler.next();
      float depth = opticalDepth(uniformOf(random.x)), end = walk.exit() - walk.enter();
      if (*nearest && (*nearest)->distance.enter == walk.enter())
        end = minimum(end, (*nearest)->distance.past);
      return trackCellClosely(
          scene, ray, walk, passed / bound, end, sampler, &random, &depth, tentative, nearest,
          [&](const VoxelCell& cell, glm::vec3 point, float least, float* way) {
            return boundAhead(scene, n, ray, cell, point, least, way, cost);
          },
          [&](float own, RayDistance at, glm::vec3 point, const RandomBlock& numbers) {
            return testChannel<Blend>(scene, channels, n, own, at, point, numbers, cost);
          });
    }
  }
}

/// Tracks one channel, but not beyond `nearest`. Returns its hit or, if there is none, `nearest`.
template <class Blend>
struct AlongChannel {
  int n;
  std::optional<Collision> nearest;

  template <bool kClosely, class View>
  SCOLOPAX_HD std::optional<Collision> along(const View& scene, const Ray& ray, Interval inside,
                                             Sampler& sampler, SampleCost* cost, bool* stuck) const {
    CellWalk walk(ray, inside, scene.majorants);
    std::optional<Collision> hit = nearest;
    std::uint32_t tentative = 0;
    do {
      if (hit && nearer(hit->distance, {walk.enter(), 0.0f})) return hit;
      ++cost->cellSteps;
      const CellOutcome outcome = trackCell<kClosely, Blend>(scene, channelsFor<kClosely>(inside), n, ray,
                                                             walk, sampler, &hit, &tentative, cost);
      if (outcome == CellOutcome::exhausted) cost->truncated = 1;
      if (outcome == CellOutcome::stuck) *stuck = true;
      if (outcome != CellOutcome::nothing) return hit;
    } while (walk.advance());
    return hit;
  }
};

/// The nearer of `nearest` and the first collision of channel n along the ray.
template <class Blend, class View>
SCOLOPAX_HD std::optional<Collision> trackChannel(const View& scene, int n,
                                                  const std::optional<Collision>& nearest, const Ray& ray,
                                                  Interval inside, Sampler& sampler, SampleCost* cost) {
  return trackWithPatience(AlongChannel<Blend>{n, nearest}, scene, ray, inside, sampler, cost);
}

/// Listing 3, with the order of its two tests corrected.
struct NDda {
  template <class Blend, class View>
  SCOLOPAX_HD static std::optional<Collision> track(const View& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    std::optional<Collision> nearest;
    for (int n = 0; n < scene.channelCount; ++n)
      nearest = trackChannel<Blend>(scene, n, nearest, ray, inside, sampler, cost);
    return nearest;
  }
};

/// Tracks all channels, macrocell by macrocell.
template <class Blend>
struct AlongCells {
  template <bool kClosely, class View>
  SCOLOPAX_HD std::optional<Collision> along(const View& scene, const Ray& ray, Interval inside,
                                             Sampler& sampler, SampleCost* cost, bool* stuck) const {
    CellWalk walk(ray, inside, scene.majorants);
    std::uint32_t tentative = 0;
    do {
      ++cost->cellSteps;
      if (!(scene.majorants.total(walk.index()) > 0.0f)) continue;
      std::optional<Collision> nearest;
      for (int n = 0; n < scene.channelCount; ++n) {
        const CellOutcome outcome = trackCell<kClosely, Blend>(scene, channelsFor<kClosely>(inside), n, ray,
                                                               walk, sampler, &nearest, &tentative, cost);
        if (outcome == CellOutcome::exhausted) cost->truncated = 1;
        if (outcome == CellOutcome::stuck) *stuck = true;
        if (outcome == CellOutcome::exhausted || outcome == CellOutcome::stuck) return std::nullopt;
      }
      if (nearest) return nearest;
    } while (walk.advance());
    return std::nullopt;
  }
};

/// Listing 4.
struct SyncDda {
  template <class Blend, class View>
  SCOLOPAX_HD static std::optional<Collision> track(const View& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    return trackWithPatience(AlongCells<Blend>{}, scene, ray, inside, sampler, cost);
  }
};

}  // namespace scolopax::kernel
