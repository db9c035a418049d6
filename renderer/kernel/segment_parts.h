// SPDX-License-Identifier: Apache-2.0
// What the channels do on a segment of a ray: their extinction, emission and its centre, and which of them
// counts where they hide each other. After segments.h, before raymarch.h and strata.h.
#pragma once
#include <type_traits>

#include "renderer/kernel/segments.h"

namespace scolopax::kernel {

/// What one channel does on a segment: means over the segment of its part in the extinction that is seen, of
/// that times its colour, and of that times the place in [0,1]. Per world unit.
using Part = StretchMeans;

SCOLOPAX_HD inline Part scaled(const Part& part, float factor) {
  return {part.opacity * factor, part.emission * factor, part.moment * factor};
}

/// Part of channel n on segment k of a run, as if it were alone. Next to voxels that are not finite only the
/// half of the segment that has a value counts.
SCOLOPAX_HD inline Part partAlone(const ChannelView& channel, const float* position) {
  const float p = position[0], q = position[1];
  const OpticalCurveView& curve = channel.optical;
  if ((p <= curve.first && q <= curve.first) || (p >= curve.last && q >= curve.last)) return {};
  if (p == p && q == q) return scaled(meansBetween(curve, p, q), channel.density);
  if (p != p && q != q) return {};
  const float finite = p == p ? p : q;
  return scaled(meansBetween(curve, finite, finite), 0.5f * channel.density);
}

/// Where channels hide each other, extinctions are compared at this many places of a segment, and at this
/// many where a channel's curve is not one line on it.
inline constexpr int kPlaces = 2, kPlacesAtKnots = 8;

/// Channels of one segment where only the largest extinction counts (Eq. 8).
struct Largests {
  int places;
  float extinction[kPlacesAtKnots];
  int channel[kPlacesAtKnots];
};

/// In their place where extinctions add up.
struct NoLargests {};
template <class Blend>
using LargestsOf = std::conditional_t<Blend::kSums, NoLargests, Largests>;

/// What a channel is at a place in [0,1] of a segment.
SCOLOPAX_HD inline Optical opticalOn(const ChannelView& channel, const float* position, float place) {
  float p = position[0], q = position[1];
  if (p != p) p = q;
  if (q != q) q = p;
  if (p != p) return {0.0f, glm::vec3(0.0f)};
  Optical optical = opticalAt(channel.optical, p + place * (q - p));
  optical.opacity *= channel.density;
  return optical;
}

SCOLOPAX_HD inline void findLargests(const SceneView& scene, const SegmentRun& run, int k,
                                     Largests& largests) {
  largests.places = kPlaces;
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(run.active[k] >> n & 1)) continue;
    const OpticalCurveView& curve = scene.channels[n].optical;
    if (pieceAt(curve, run.position[n][k]) != pieceAt(curve, run.position[n][k + 1]))
      largests.places = kPlacesAtKnots;
  }
  for (int i = 0; i < largests.places; ++i) {
    const float place = (float(i) + 0.5f) / float(largests.places);
    largests.extinction[i] = 0.0f;
    largests.channel[i] = 0;
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(run.active[k] >> n & 1)) continue;
      const float extinction = opticalOn(scene.channels[n], &run.position[n][k], place).opacity;
      if (extinction > largests.extinction[i]) largests.extinction[i] = extinction, largests.channel[i] = n;
    }
  }
}
SCOLOPAX_HD inline float meanOf(const Largests& largests) {
  float sum = 0.0f;
  for (int i = 0; i < largests.places; ++i) sum += largests.extinction[i];
  return sum / float(largests.places);
}

/// The same of channel n among others: in max where it is the largest, in mix weighted.
template <class Blend>
SCOLOPAX_HD Part partAmong(const ChannelView& channel, int n, const float* position,
                           const Largests& largests) {
  Part part;
  const float share = 1.0f / float(largests.places);
  for (int i = 0; i < largests.places; ++i) {
    if (!Blend::kMixes && largests.channel[i] != n) continue;
    const float place = (float(i) + 0.5f) * share;
    const Optical o = opticalOn(channel, position, place);
    const float seen = o.opacity * share * (Blend::kMixes ? channel.weight : 1.0f);
    part.opacity += seen;
    part.emission += seen * o.color;
    part.moment += seen * place;
  }
  return part;
}

/// What the channels of a walk's segment do on it. One channel alone needs no comparisons.
template <class Blend>
class SegmentParts {
 public:
  /// `largests` is apart from the rest as SegmentRun is.
  SCOLOPAX_HD SegmentParts(LargestsOf<Blend>& largests, const SceneView& scene, const SegmentWalk& walk)
      : largests_(largests), scene_(scene), run_(walk.run()), k_(walk.k()) {
    if constexpr (!Blend::kSums) {
      compared_ = (run_.active[k_] & (run_.active[k_] - 1)) != 0;
      if (compared_) findLargests(scene, run_, k_, largests_);
    }
  }

  /// Calls visit(n, part) for every channel that is seen, and returns the mean extinction.
  template <class Visit>
  SCOLOPAX_HD float visit(Visit&& visit) const {
    float extinction = 0.0f;
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(run_.active[k_] >> n & 1)) continue;
      const ChannelView& channel = scene_.channels[n];
      const float* position = &run_.position[n][k_];
      Part part;
      if constexpr (!Blend::kSums) {
        if (compared_) {
          part = partAmong<Blend>(channel, n, position, largests_);
          if (part.opacity > 0.0f) visit(n, part);
          continue;
        }
      }
      part = partAlone(channel, position);
      if (!(part.opacity > 0.0f)) continue;
      extinction += part.opacity;
      if constexpr (!Blend::kMixes)
        visit(n, part);
      else if (channel.weight > 0.0f)
        visit(n, scaled(part, channel.weight));
    }
    if constexpr (!Blend::kSums)
      if (compared_) return meanOf(largests_);
    return extinction;
  }

 private:
  LargestsOf<Blend>& largests_;
  const SceneView& scene_;
  const SegmentRun& run_;
  int k_;
  bool compared_ = false;
};

}  // namespace scolopax::kernel
