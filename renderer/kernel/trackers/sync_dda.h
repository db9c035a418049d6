// SPDX-License-Identifier: Apache-2.0
// Synchronised traversal (Listing 4): inside each macrocell every channel is tracked on its own; the nearest
// accepted collision wins and ends the traversal.
#pragma once
#include "renderer/kernel/collision.h"

namespace scolopax::kernel {

struct SyncDda {
  SCOLOPAX_HD static std::optional<Collision> track(const SceneView& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    const int channels = scene.channelCount;
    CellWalk walk(ray, inside, scene.majorants);
    std::uint32_t tentative = 0;
    do {
      ++cost->cellSteps;
      const float* bounds = scene.majorants.values + walk.index() * std::size_t(1 + channels);
      if (!(bounds[0] > 0.0f)) continue;
      std::optional<Collision> nearest;
      // Length before the end of the cell at which the nearest collision so far lies.
      float nearestLeft = 0.0f;
      const float length = walk.exit() - walk.enter();
      for (int n = 0; n < channels; ++n) {
        const float majorant = bounds[1 + n];
        if (!(majorant > 0.0f)) continue;
        float left = majorant * length;
        const float end = majorant * nearestLeft;
        while (true) {
          const RandomBlock random = sampler.next();
          left -= opticalDepth(uniformOf(random.x));
          if (!(left > end)) break;  // the cell's end, or something nearer, comes first
          const float t = walk.exit() - left / majorant;
          float position;
          if (accept(scene, n, majorant, walk.pointAt(t), uniformOf(random.z), &position, cost)) {
            nearest = Collision{t, n, position};
            nearestLeft = left / majorant;
            break;
          }
          if (++tentative >= kMaxTentativeCollisions) {
            cost->truncated = 1;
            return std::nullopt;
          }
        }
      }
      if (nearest) return nearest;
    } while (walk.advance());
    return std::nullopt;
  }
};

}  // namespace scolopax::kernel
