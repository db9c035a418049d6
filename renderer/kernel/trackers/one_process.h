// SPDX-License-Identifier: Apache-2.0
// Tracking with one Poisson process for all channels. Superposed and cumulative differ only in how a
// tentative collision is tested.
#pragma once
#include <type_traits>

#include "renderer/kernel/trackers/close_look.h"

namespace scolopax::kernel {

/// Combined bound of several channels ahead of a point; boundAhead() gives it for one channel.
template <bool kSums, class View>
SCOLOPAX_HD float boundAheadOf(SomeChannels channels, const View& scene, std::size_t macrocell,
                               const Ray& ray, const VoxelCell& cell, glm::vec3 point, float least,
                               float* way, SampleCost* cost) {
  float all = 0.0f;
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!channels.has(n) || !(scene.majorants.bound(macrocell, n) > 0.0f)) continue;
    const float bound = boundAhead(scene, n, ray, cell, point, least, way, cost);
    all = kSums ? all + bound : maximum(all, bound);
  }
  return all;
}

/// Combined bound of several channels in a macrocell.
template <bool kSums>
SCOLOPAX_HD float totalBound(const SceneView& scene, AllChannels, std::size_t cell) {
  return scene.majorants.total(cell);
}
template <bool kSums>
SCOLOPAX_HD float totalBound(const SceneView& scene, SomeChannels channels, std::size_t cell) {
  const float all = scene.majorants.total(cell);
  if (!(all > 0.0f) || channels.bits == ~0u) return all;
  float some = 0.0f;
  for (int n = 0; n < scene.channelCount; ++n) {
    const float own = channels.has(n) ? scene.majorants.bound(cell, n) : 0.0f;
    some = kSums ? some + own : maximum(some, own);
  }
  return some;
}

/// The sum of independent Poisson processes is one Poisson process. One optical depth is drawn per tentative
/// collision and carried across macrocells, so a cell costs a multiplication and no logarithm. In close
/// tracking, TestClosely takes the place of Test: it needs no bounds of single channels.
template <class Test, class TestClosely, bool kSums>
struct OneProcess {
  template <bool kClosely, class View>
  SCOLOPAX_HD std::optional<Collision> along(const View& scene, const Ray& ray, Interval inside,
                                             Sampler& sampler, SampleCost* cost, bool* stuck) const {
    const auto channels = channelsFor<kClosely>(inside);
    RandomBlock random = sampler.next();
    float depth = opticalDepth(uniformOf(random.x));
    CellWalk walk(ray, inside, scene.majorants);
    std::uint32_t tentative = 0;
    do {
      ++cost->cellSteps;
      const float bound = totalBound<kSums>(scene, channels, walk.index());
      if (!(bound > 0.0f)) continue;
      // Optical depth since the cell's entry. Kept instead of t, so that a step shorter than the resolution
      // of t still makes progress.
      const float total = bound * (walk.exit() - walk.enter());
      float passed = 0.0f;
      std::uint32_t limit = patienceAfter(tentative);
      while (depth < total - passed) {
        passed += depth;
        const RayDistance distance{walk.enter(), passed / bound};
        if (const auto hit = Test::test(scene, channels, walk.index(), bound, distance,
                                        walk.pointAt(distance.t()), random, cost))
          return hit;
        random = sampler.next();
        depth = opticalDepth(uniformOf(random.x));
        if (++tentative >= limit) {
          if (tentative >= kMaxTentativeCollisions || scene.isCancelled()) {
            cost->truncated = 1;
            return std::nullopt;
          }
          limit = patienceAfter(tentative);
          if (!(total - passed > kManyCollisions)) continue;
          if constexpr (!kClosely) {
            *stuck = true;
            return std::nullopt;
          } else {
            std::optional<Collision> hit;
            const CellOutcome outcome = trackCellClosely(
                scene, ray, walk, passed / bound, walk.exit() - walk.enter(), sampler, &random, &depth,
                &tentative, &hit,
                [&](const VoxelCell& cell, glm::vec3 point, float least, float* way) {
                  return boundAheadOf<kSums>(channels, scene, walk.index(), ray, cell, point, least, way,
                                             cost);
                },
                [&](float all, RayDistance at, glm::vec3 point, const RandomBlock& numbers) {
                  return TestClosely::test(scene, channels, walk.index(), all, at, point, numbers, cost);
                });
            if (outcome == CellOutcome::exhausted) cost->truncated = 1;
            if (outcome != CellOutcome::nothing) return hit;
            passed = total;  // the rest of `depth` lies behind the cell
          }
        }
      }
      depth -= total - passed;
    } while (walk.advance());
    return std::nullopt;
  }
};

/// Where extinctions add up, only one channel is drawn, fetched and tested.
struct Superposed {
  template <class Blend, class View>
  SCOLOPAX_HD static std::optional<Collision> track(const View& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    using Test = std::conditional_t<Blend::kSums, PickOneChannel, TestLargest>;
    using TestClosely = std::conditional_t<Blend::kSums, TestAllChannels, TestLargest>;
    return trackWithPatience(OneProcess<Test, TestClosely, Blend::kSums>{}, scene, ray, inside, sampler,
                             cost);
  }
};

/// All channels are fetched and their sum is tested (section 5.1).
struct Cumulative {
  template <class Blend, class View>
  SCOLOPAX_HD static std::optional<Collision> track(const View& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    using Test = std::conditional_t<Blend::kSums, TestAllChannels, TestLargest>;
    return trackWithPatience(OneProcess<Test, Test, Blend::kSums>{}, scene, ray, inside, sampler, cost);
  }
};

}  // namespace scolopax::kernel
