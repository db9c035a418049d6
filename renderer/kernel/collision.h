// SPDX-License-Identifier: Apache-2.0
// What trackers look for, and the tests of a tentative collision that they share.
#pragma once
#include <optional>

#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/rng.h"

namespace scolopax::kernel {

/// A distance along a ray, in world units, kept as the entry of a macrocell and the way past it: free flights
/// far shorter than the resolution of their sum can still be told apart.
struct Place {
  float enter, past;
  SCOLOPAX_HD float t() const { return enter + past; }
};
SCOLOPAX_HD inline bool nearer(const Place& a, const Place& b) {
  return a.enter < b.enter || (a.enter == b.enter && a.past < b.past);
}

/// Nearest accepted collision along a ray.
struct Collision {
  Place place;
  glm::vec3 point;  ///< voxel coordinates
  int channel;      ///< among the visible channels
  float position;   ///< on that channel's curves
};

SCOLOPAX_HD inline void keepNearer(FirstCollision* first, const FirstCollision& other) {
  if (first->channel < 0 || other.depth < first->depth) *first = other;
}

/// Tentative collisions after which a ray gives up and counts as truncated: a bound on its work, far above
/// what any thickness that can be told from opaque needs.
inline constexpr std::uint32_t kMaxTentativeCollisions = 1u << 20;

/// Tests a tentative collision of the process of several channels together in a macrocell; `bound` is their
/// total. Accepts with probability extinction / bound (Eq. 4), strictly below, so that zero extinction is
/// never hit.
struct PickOneChannel {
  /// Draws the channel first, with probability bound_n / bound, and fetches only that one. What the bounds
  /// leave of the total belongs to none.
  template <class Channels, class View>
  SCOLOPAX_HD static std::optional<Collision> test(const View& scene, Channels channels, std::size_t cell,
                                                   float bound, Place place, glm::vec3 point,
                                                   const RandomBlock& random, SampleCost* cost) {
    float pick = uniformOf(random.y) * bound;
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!channels.has(n)) continue;
      const float own = scene.majorants.bound(cell, n);
      if (pick < own) {
        const Classified c = classify(scene, n, point, cost);
        if (!(uniformOf(random.z) * own < c.extinction)) return std::nullopt;
        return Collision{place, point, n, c.position};
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
                                                   float bound, Place place, glm::vec3 point,
                                                   const RandomBlock& random, SampleCost* cost) {
    float left = uniformOf(random.y) * bound;
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!channels.has(n)) continue;
      const Classified c = classify(scene, n, point, cost);
      if (left < c.extinction) return Collision{place, point, n, c.position};
      left -= c.extinction;
    }
    return std::nullopt;
  }
};
/// The same for max and mix, whose bound is the largest of the channels'.
struct TestLargest {
  template <class Channels, class View>
  SCOLOPAX_HD static std::optional<Collision> test(const View& scene, Channels channels, std::size_t,
                                                   float bound, Place place, glm::vec3 point,
                                                   const RandomBlock& random, SampleCost* cost) {
    const Largest largest = largestOf(scene, channels, point, cost);
    if (!(uniformOf(random.z) * bound < largest.extinction)) return std::nullopt;
    return Collision{place, point, largest.channel, largest.position};
  }
};

/// Tests a tentative collision of channel n's own process. In max and mix a channel has extinction only where
/// it is the largest of `channels` (Eq. 8).
template <class Blend, class Channels, class View>
SCOLOPAX_HD std::optional<Collision> testChannel(const View& scene, Channels channels, int n, float bound,
                                                 Place place, glm::vec3 point, const RandomBlock& random,
                                                 SampleCost* cost) {
  const Classified c = classify(scene, n, point, cost);
  if (!(uniformOf(random.z) * bound < c.extinction)) return std::nullopt;
  if constexpr (!Blend::kSums)
    for (int other = 0; other < scene.channelCount; ++other) {
      if (other == n || !channels.has(other)) continue;
      const float extinction = classify(scene, other, point, cost).extinction;
      if (extinction > c.extinction || (extinction == c.extinction && other < n)) return std::nullopt;
    }
  return Collision{place, point, n, c.position};
}

}  // namespace scolopax::kernel
