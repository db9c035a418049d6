// SPDX-License-Identifier: Apache-2.0
// Superposed tracking: independent Poisson processes add up to one, so one optical depth is drawn for all
// channels and carried across macrocells; the channel of a tentative collision is drawn afterwards.
#pragma once
#include "renderer/kernel/collision.h"

namespace scolopax::kernel {

struct Superposed {
  SCOLOPAX_HD static std::optional<Collision> track(const SceneView& scene, const Ray& ray, Interval inside,
                                                    Sampler& sampler, SampleCost* cost) {
    const int channels = scene.channelCount;
    RandomBlock random = sampler.next();
    float depth = opticalDepth(uniformOf(random.x));
    CellWalk walk(ray, inside, scene.majorants);
    std::uint32_t tentative = 0;
    do {
      ++cost->cellSteps;
      const float* bounds = scene.majorants.values + walk.index() * std::size_t(1 + channels);
      const float sum = bounds[0];
      if (!(sum > 0.0f)) continue;
      // Optical depth still to go in this cell: kept instead of t, so that a step shorter than the
      // resolution of t still makes progress.
      const float length = walk.exit() - walk.enter();
      float left = sum * length;
      while (depth < left) {
        left -= depth;
        // Which process did it: channel n with probability bound_n / sum.
        float pick = uniformOf(random.y) * sum;
        int n = 0;
        while (n + 1 < channels && pick >= bounds[1 + n]) pick -= bounds[1 + n++];
        const float t = walk.exit() - left / sum;
        float position;
        if (accept(scene, n, bounds[1 + n], walk.pointAt(t), uniformOf(random.z), &position, cost))
          return Collision{t, n, position};
        if (++tentative >= kMaxTentativeCollisions) {
          cost->truncated = 1;
          return std::nullopt;
        }
        random = sampler.next();
        depth = opticalDepth(uniformOf(random.x));
      }
      depth -= left;
    } while (walk.advance());
    return std::nullopt;
  }
};

}  // namespace scolopax::kernel
