// SPDX-License-Identifier: Apache-2.0
// Tracking with one Poisson process for all channels: superposed and cumulative differ only in how a
// tentative collision is tested.
#pragma once
#include <type_traits>

#include "renderer/kernel/collision.h"

namespace scolopax::kernel {

/// Independent Poisson processes add up to one: ONE optical depth is drawn per tentative collision and
/// carried across macrocells, so that a cell costs a multiplication and no logarithm.
template <class Test>
SCOLOPAX_HD std::optional<Collision> trackOneProcess(const SceneView& scene, const Ray& ray, Interval inside,
                                                     Sampler& sampler, SampleCost* cost) {
  RandomBlock random = sampler.next();
  float depth = opticalDepth(uniformOf(random.x));
  CellWalk walk(ray, inside, scene.majorants);
  std::uint32_t tentative = 0;
  do {
    ++cost->cellSteps;
    const float bound = scene.majorants.total(walk.index());
    if (!(bound > 0.0f)) continue;
    // Optical depth since the cell's entry: kept instead of t, so that a step shorter than the resolution of
    // t still makes progress.
    const float total = bound * (walk.exit() - walk.enter());
    float passed = 0.0f;
    while (depth < total - passed) {
      passed += depth;
      const Place place{walk.enter(), passed / bound};
      if (const auto hit =
              Test::test(scene, walk.index(), bound, place, walk.pointAt(place.t()), random, cost))
        return hit;
      if (++tentative >= kMaxTentativeCollisions) {
        cost->truncated = 1;
        return std::nullopt;
      }
      random = sampler.next();
      depth = opticalDepth(uniformOf(random.x));
    }
    depth -= total - passed;
  } while (walk.advance());
  return std::nullopt;
}

/// A drawn channel is fetched and tested.
struct Superposed {
  template <class Blend>
  SCOLOPAX_HD static std::optional<Collision> track(const SceneView& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    using Test = std::conditional_t<Blend::kSums, PickOneChannel, TestLargest>;
    return trackOneProcess<Test>(scene, ray, inside, sampler, cost);
  }
};

/// All channels are fetched and their sum is tested (section 5.1).
struct Cumulative {
  template <class Blend>
  SCOLOPAX_HD static std::optional<Collision> track(const SceneView& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    using Test = std::conditional_t<Blend::kSums, TestAllChannels, TestLargest>;
    return trackOneProcess<Test>(scene, ray, inside, sampler, cost);
  }
};

}  // namespace scolopax::kernel
