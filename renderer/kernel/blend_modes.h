// SPDX-License-Identifier: Apache-2.0
// The blend modes: what N extinctions and colours at a point become. One struct each; data/method.h lists
// them, trackers and shading ask only for what is declared here.
#pragma once
#include "renderer/kernel/clip.h"
#include "renderer/kernel/gradient.h"

namespace scolopax::kernel {

/// Extinction of one channel at a point, and where it lies on the channel's curves; 0 where the voxels are
/// not finite.
struct Classified {
  float extinction, position;
};
template <class View>
SCOLOPAX_HD Classified classify(const View& scene, int n, glm::vec3 point, SampleCost* cost) {
  const ChannelView& channel = scene.channels[n];
  ++cost->fetches;
  const float stored = sampleStored(channel, scene.dims, point);
  if (!isFinite(stored)) return {0.0f, 0.0f};
  const float position = curvePosition(channel, stored);
  float extinction = extinctionAt(channel, position);
  if (scene.hasFactor(n) && extinction > 0.0f) [[unlikely]] {
    extinction *= gradientFactorAt(channel, scene.dims, point);
    cost->fetches += gradientFetches(scene.dims);
  }
  return {extinction, position};
}

/// Which visible channels matter: all, and the loops over them need not ask; or some, by their bits.
struct AllChannels {
  SCOLOPAX_HD static constexpr bool has(int) { return true; }
};
struct SomeChannels {
  std::uint32_t bits;
  SCOLOPAX_HD constexpr bool has(int n) const { return bits >> n & 1; }
};

/// Channel of the largest extinction; the lowest of equal ones.
struct Largest {
  float extinction = 0.0f;
  int channel = 0;
  float position = 0.0f;
};
template <class Channels, class View>
SCOLOPAX_HD Largest largestOf(const View& scene, Channels channels, glm::vec3 point, SampleCost* cost) {
  Largest largest;
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!channels.has(n)) continue;
    const Classified c = classify(scene, n, point, cost);
    if (c.extinction > largest.extinction) largest = {c.extinction, n, c.position};
  }
  return largest;
}

/// Extinctions add up; a collision happens in one channel and shows its colour (Eq. 6-7).
struct BlendDensity {
  static constexpr bool kSums = true;       ///< bound of all channels together: their sum; else the largest
  static constexpr bool kSeparate = false;  ///< channels do not see each other
  static constexpr bool kMixes = false;     ///< a collision shows all channels, weighted
};
/// The channel of the largest extinction hides the others (Eq. 8-9).
struct BlendMax {
  static constexpr bool kSums = false, kSeparate = false, kMixes = false;
};
/// Extinction as max; the colours of all channels weighted by extinction and the user's weight (Eq. 8, 10).
struct BlendMix {
  static constexpr bool kSums = false, kSeparate = false, kMixes = true;
};
/// Every channel rendered alone, pictures added (section 4.2).
struct BlendComposite {
  static constexpr bool kSums = true, kSeparate = true, kMixes = false;
};

}  // namespace scolopax::kernel
