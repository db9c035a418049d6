// SPDX-License-Identifier: Apache-2.0
// The defect in the paper's Listing 3, for tests that must detect it.
#pragma once
#include "renderer/kernel/trackers/process_per_channel.h"

namespace scolopax::test {

/// Listing 3 as printed: a step beyond the nearest collision so far ends the traversal, although it may also
/// lie beyond the end of a thin cell with a denser one behind.
struct PrintedNDda {
  template <class Blend>
  static std::optional<kernel::Collision> track(const kernel::SceneView& scene, const kernel::Ray& ray,
                                                kernel::Interval inside, kernel::Sampler& sampler,
                                                kernel::SampleCost* cost) {
    std::optional<kernel::Collision> nearest;
    for (int n = 0; n < scene.channelCount; ++n)
      trackPrinted<Blend>(scene, n, ray, inside, sampler, &nearest, cost);
    return nearest;
  }

 private:
  template <class Blend>
  static void trackPrinted(const kernel::SceneView& scene, int n, const kernel::Ray& ray,
                           kernel::Interval inside, kernel::Sampler& sampler,
                           std::optional<kernel::Collision>* nearest, kernel::SampleCost* cost) {
    kernel::CellWalk walk(ray, inside, scene.majorants);
    do {
      const float bound = scene.majorants.bound(walk.index(), n);
      if (!(bound > 0)) continue;
      float t = walk.enter();
      while (true) {
        const kernel::RandomBlock random = sampler.next();
        t += kernel::opticalDepth(kernel::uniformOf(random.x)) / bound;
        if (*nearest && t > (*nearest)->distance.t()) return;  // in the printed order
        if (!(t < walk.exit())) break;
        const kernel::RayDistance distance{t, 0};
        if (const auto hit = kernel::testChannel<Blend>(scene, kernel::AllChannels{}, n, bound, distance,
                                                        walk.pointAt(t), random, cost)) {
          *nearest = hit;
          return;
        }
      }
    } while (walk.advance());
  }
};

}  // namespace scolopax::test
