// SPDX-License-Identifier: Apache-2.0
// The blend modes: how the extinctions and colours of N channels at a point are combined. Each is a struct,
// listed in data/method.h; trackers and shading use only what is declared here.
#pragma once
#include "renderer/kernel/classifiers.h"
#include "renderer/kernel/clip.h"

namespace scolopax::kernel {

/// A set of visible channels: all of them, so that loops over them need no test, or some, given by their
/// bits.
struct AllChannels {
  SCOLOPAX_HD static constexpr bool has(int) { return true; }
};
struct SomeChannels {
  std::uint32_t bits;
  SCOLOPAX_HD constexpr bool has(int n) const { return bits >> n & 1; }
};

/// The channel with the largest extinction; of equal ones, the lowest.
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

/// Extinctions add up; a collision happens in one channel and has its colour (Eq. 6-7).
struct BlendDensity {
  static constexpr bool kSums = true;       ///< the combined bound is the channels' sum; else their maximum
  static constexpr bool kSeparate = false;  ///< channels are rendered independently
  static constexpr bool kMixes = false;     ///< a collision has the weighted colours of all channels
};
/// The channel of the largest extinction hides the others (Eq. 8-9).
struct BlendMax {
  static constexpr bool kSums = false, kSeparate = false, kMixes = false;
};
/// Extinction as in max; the colours of all channels are weighted by extinction and the user's weight (Eq. 8,
/// 10).
struct BlendMix {
  static constexpr bool kSums = false, kSeparate = false, kMixes = true;
};
/// Every channel is rendered alone, and the pictures are added (section 4.2).
struct BlendComposite {
  static constexpr bool kSums = true, kSeparate = true, kMixes = false;
};

}  // namespace scolopax::kernel
