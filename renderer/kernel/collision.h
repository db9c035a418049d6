// SPDX-License-Identifier: Apache-2.0
// Collisions, which trackers search for, and the tests of a tentative collision that they share.
#pragma once
#include <optional>

#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/sample_records.h"

namespace scolopax::kernel {

/// A distance along a ray, in world units, stored as the entry of a macrocell and the distance past it. So
/// free flights far shorter than the float resolution of the sum can still be told apart.
struct RayDistance {
  float enter, past;
  SCOLOPAX_HD float t() const { return enter + past; }
};
SCOLOPAX_HD inline bool nearer(const RayDistance& a, const RayDistance& b) {
  return a.enter < b.enter || (a.enter == b.enter && a.past < b.past);
}

/// An accepted collision along a ray.
struct Collision {
  RayDistance distance;
  glm::vec3 point;  ///< voxel coordinates
  int channel;      ///< index among the visible channels
  float position;   ///< position on that channel's curves
};

/// Maximum number of tentative collisions of a ray. A ray with more stops there and counts as truncated. This
/// bounds the work, and is far above what is needed for any optical depth that is distinguishable from
/// opaque.
inline constexpr std::uint32_t kMaxTentativeCollisions = 1u << 20;

/// Tests a tentative collision of the combined process of several channels in a macrocell, whose combined
/// bound is `bound`. Accepts with probability extinction / bound (Eq. 4). The comparison is strict, so that
/// zero extinction is never hit.
struct PickOneChannel {
  /// Draws a channel first, with probability bound_n / bound, and fetches only that one. Where the combined
  /// bound exceeds the sum of the channels' bounds, the excess belongs to no channel.
  template <class Channels, class View>
  SCOLOPAX_HD static std::optional<Collision> test(const View& scene, Channels channels, std::size_t cell,
                                                   float bound, RayDistance distance, glm::vec3 point,
                                                   const RandomBlock& random, SampleCost* cost) {
    float pick = uniformOf(random.y) * bound;
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!channels.has(n)) continue;
      const float own = scene.majorants.bound(cell, n);
      if (pick < own) {
        const Classified c = classify(scene, n, point, cost);
        if (!(uniformOf(random.z) * own < c.extinction)) return std::nullopt;
        return Collision{distance, point, n, c.position};
      }
      pick -= own;
    }
    return std::nullopt;
  }
};
struct TestAllChannels {
  /// Fetches channel after channel until the drawn share of the bound is used up.
  template <class Channels, class View>
  SCOLOPAX_HD static std::optional<Collision> test(const View& scene, Channels channels, std::size_t,
                                                   float bound, RayDistance distance, glm::vec3 point,
                                                   const RandomBlock& random, SampleCost* cost) {
    float left = uniformOf(random.y) * bound;
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!channels.has(n)) continue;
      const Classified c = classify(scene, n, point, cost);
      if (left < c.extinction) return Collision{distance, point, n, c.position};
      left -= c.extinction;
    }
    return std::nullopt;
  }
};
/// The same for max and mix, where `bound` is the largest of the channels' bounds.
struct TestLargest {
  template <class Channels, class View>
  SCOLOPAX_HD static std::optional<Collision> test(const View& scene, Channels channels, std::size_t,
                                                   float bound, RayDistance distance, glm::vec3 point,
                                                   const RandomBlock& random, SampleCost* cost) {
    const Largest largest = largestOf(scene, channels, point, cost);
    if (!(uniformOf(random.z) * bound < largest.extinction)) return std::nullopt;
    return Collision{distance, point, largest.channel, largest.position};
  }
};

/// Tests a tentative collision of channel n's own process. In max and mix, a channel has extinction only
/// where its extinction is the largest among `channels` (Eq. 8).
template <class Blend, class Channels, class View>
SCOLOPAX_HD std::optional<Collision> testChannel(const View& scene, Channels channels, int n, float bound,
                                                 RayDistance distance, glm::vec3 point,
                                                 const RandomBlock& random, SampleCost* cost) {
  const Classified c = classify(scene, n, point, cost);
  if (!(uniformOf(random.z) * bound < c.extinction)) return std::nullopt;
  if constexpr (!Blend::kSums)
    for (int other = 0; other < scene.channelCount; ++other) {
      if (other == n || !channels.has(other)) continue;
      const float extinction = classify(scene, other, point, cost).extinction;
      if (extinction > c.extinction || (extinction == c.extinction && other < n)) return std::nullopt;
    }
  return Collision{distance, point, n, c.position};
}

}  // namespace scolopax::kernel
