// SPDX-License-Identifier: Apache-2.0
// Contributions of the channels to a segment of every ray: their extinction, its centre, and their emission,
// and which of them counts where they hide each other. Takes segments (point_segments.h); used by raymarch.h
// and strata.h.
#pragma once
#include "renderer/kernel/jumps.h"

namespace scolopax::kernel {

/// How quadrature cuts rays into segments, and what it knows of the scalars on a segment: at equal steps,
/// with scalars that are taken to be linear in between.
struct EqualSteps {
  static constexpr bool kDivides = false;  ///< segments of dense matter can be shortened
  template <class L, class View>
  using Cuts = Segments<L, View>;
  /// The same for rays on which no segment is shortened.
  template <class L, class View>
  using WholeCuts = Segments<L, View>;
  template <class L, class View>
  using Scalars = SegmentEnds<L, View>;
};
/// At the faces of voxel cells, between which scalars are cubics.
struct VoxelCells {
  static constexpr bool kDivides = true;
  template <class L, class View>
  using Cuts = VoxelSegments<L, View>;
  template <class L, class View>
  using WholeCuts = WholeVoxelSegments<L, View>;
  template <class L, class View>
  using Scalars = SegmentCubics<L, View>;
};

/// A blend mode as quadrature uses it. Only kSums is chosen at compile time.
template <bool kSumsExtinction>
struct Blending {
  static constexpr bool kSums = kSumsExtinction;  ///< extinctions add up; else the largest counts (Eq. 8)
  bool separate;                                  ///< channels are rendered independently
  bool mixes;  ///< the largest extinction has the weighted colours of all channels
};

/// Where channels hide each other and the extinction of some channel may not be linear on a segment, they are
/// compared in this many parts of it.
inline constexpr int kPartsAtKnots = 8;

/// The parts of channels that hide each other, and what compare() keeps of the channels: here, because a
/// device compiler would reserve memory for it at each place where compare() is inlined.
template <class L, bool kSums>
struct Hidden {
  PartOf<L> of[kMaxVisibleChannels];
  Optical<L> at[2][kMaxVisibleChannels];       ///< at the ends of a part
  typename L::Int piece[kMaxVisibleChannels];  ///< for Jumps
};
/// Empty where extinctions add up.
template <class L>
struct Hidden<L, true> {};

/// Adds a part of a segment from `begin` to `end`, for rays in `on`, over which the channels' extinctions and
/// colours are linear: sets `hidden` to the visible part of each channel, and returns the largest extinction,
/// times the part's share of the segment. At most one channel takes over from another: where their
/// extinctions are equal.
template <Detail kDetail, class L, class View>
SCOLOPAX_LANES typename L::Float addLargest(const View& scene, bool mixes, const Segment<L>& segment,
                                            const Optical<L>* front, const Optical<L>* back,
                                            typename L::Float begin, typename L::Float end,
                                            typename L::Mask on, Hidden<L, false>& hidden) {
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;
  // The largest at either end, and each of the two at the other end.
  Float largest(0.0f), largestBehind(0.0f), before(0.0f), after(0.0f);
  Int winner(-1), next(-1);
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(segment.channels >> n & 1)) continue;
    const Mask larger = front[n].opacity > largest, largerBehind = back[n].opacity > largestBehind;
    largest = select(larger, front[n].opacity, largest);
    winner = select(larger, Int(n), winner);
    after = select(larger, back[n].opacity, after);
    largestBehind = select(largerBehind, back[n].opacity, largestBehind);
    next = select(largerBehind, Int(n), next);
    before = select(largerBehind, front[n].opacity, before);
  }
  const Mask same = winner == next;
  const Float lead = largest - before, behind = largestBehind - after, both = lead + behind;
  const Float turn = select(same, Float(1.0f), where(both > 0.0f, lead / both));
  const Float handed = largest + turn * (after - largest), share = end - begin;
  if constexpr (kDetail >= Detail::emission) {
    const Float place = select(same, end, begin + turn * share);
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(segment.channels >> n & 1)) continue;
      const Optical<L>&a = front[n], &b = back[n];
      if (mixes) {
        const float weight = scene.channels[n].weight;
        detail::addLinear<kDetail, L>({a.opacity * weight, a.color}, {b.opacity * weight, b.color}, begin,
                                      end, on & segment.of(n), &hidden.of[n]);
        continue;
      }
      const Mask wins = on & (winner == Int(n)), follows = without(on & (next == Int(n)), same);
      if (!any(wins | follows)) continue;
      const Optical<L> there{a.opacity + turn * (b.opacity - a.opacity),
                             a.color + turn * (b.color - a.color)};
      detail::addLinear<kDetail, L>(a, there, begin, place, wins, &hidden.of[n]);
      detail::addLinear<kDetail, L>(there, b, place, end, follows, &hidden.of[n]);
    }
  }
  return where(on, share * 0.5f * (turn * (largest + handed) + (1.0f - turn) * (handed + largestBehind)));
}

/// Compares the channels of a segment, for rays in `which`. Returns the mean of the largest extinction, and
/// sets `hidden` to the visible part of each channel. The segment is divided where curves jump and, where
/// extinctions are not linear, into kPartsAtKnots.
template <Detail kDetail, class L, class View, class Scalars>
SCOLOPAX_LANES typename L::Float compare(const View& scene, bool mixes, const Segment<L>& segment,
                                         const Scalars& scalars, typename L::Mask which,
                                         Hidden<L, false>& hidden) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  Mask bent = without(which, which);
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(segment.channels >> n & 1)) continue;
    bent = bent | without(segment.of(n), isStraight<L>(scene, scalars, n));
    if constexpr (kDetail >= Detail::emission) hidden.of[n] = noPart<L>();
  }
  const Float share = select(bent & which, Float(1.0f / kPartsAtKnots), Float(1.0f));
  auto& at = hidden.at;
  const auto look = [&](int end, Float place) SCOLOPAX_LANES_LAMBDA {
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(segment.channels >> n & 1)) continue;
      const Mask here = which & segment.of(n);
      if (any(here)) at[end][n] = opticalOn<kDetail, L>(scene, scalars, n, place, here);
      at[end][n].opacity = where(here, at[end][n].opacity);
    }
  };
  Jumps<L, View, Scalars> jumps(scene, scalars, segment, which, hidden.piece);
  // Sets the channels that jump at the end of a part to the value before their jump or behind it.
  const auto setJumping = [&](int end, Float place, bool behind) SCOLOPAX_LANES_LAMBDA {
    for (int n = 0; n < scene.channelCount; ++n) {
      const Mask here = jumps.at(n);
      if (!any(here)) continue;
      Optical<L> optical = jumps.template opticalAt<kDetail>(n, behind);
      optical.opacity = extinctionOn<L>(scene, scalars, n, place, here, optical.opacity);
      at[end][n].opacity = select(here, optical.opacity, at[end][n].opacity);
      if constexpr (kDetail >= Detail::emission)
        at[end][n].color = select(here, optical.color, at[end][n].color);
    }
  };
  look(0, Float(0.0f));
  Float sum(0.0f), begin(0.0f);
  Mask on = which;
  for (int i = 0; any(on); ++i) {
    const int front = i & 1, back = front ^ 1;
    Float end = minimum(begin + share, 1.0f);
    jumps.shorten(begin, on, &end);
    look(back, end);
    if (jumps.found()) setJumping(back, end, false);
    sum = sum + addLargest<kDetail>(scene, mixes, segment, at[front], at[back], begin, end, on, hidden);
    if (jumps.found()) setJumping(back, end, true);
    jumps.advance(end);
    begin = end;
    on = on & (end < 1.0f);
  }
  return sum;
}
/// Calls visit(n, part of channel n) for all channels of the segment, and returns the mean of the visible
/// extinction. Rays with a single channel need no comparisons.
template <Detail kDetail, class L, class Blend, class Visit, class View, class Scalars>
SCOLOPAX_LANES typename L::Float visitParts(const View& scene, const Blend& blend, const Segment<L>& segment,
                                            const Scalars& scalars,
                                            [[maybe_unused]] Hidden<L, Blend::kSums>& hidden, Visit&& visit) {
  using Float = typename L::Float;
  Float extinction(0.0f);
  if constexpr (Blend::kSums) {
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(segment.channels >> n & 1)) continue;
      const PartOf<L> part = partAlone<kDetail, L>(scene, scalars, n, segment.of(n));
      extinction = extinction + part.opacity;
      visit(n, part);
    }
    return extinction;
  } else {
    const typename L::Mask several = segment.several();
    const bool some = any(several);
    Float largest(0.0f);
    if (some) largest = compare<kDetail, L>(scene, blend.mixes, segment, scalars, several, hidden);
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(segment.channels >> n & 1)) continue;
      PartOf<L> part = noPart<L>();
      const typename L::Mask alone = without(segment.of(n), several);
      if (any(alone)) {
        part = partAlone<kDetail, L>(scene, scalars, n, alone);
        extinction = extinction + part.opacity;
        if (blend.mixes) part = scaled(part, Float(scene.channels[n].weight));
      }
      if (some && kDetail >= Detail::emission) part = sum(part, hidden.of[n]);
      visit(n, part);
    }
    return select(several, largest, extinction);
  }
}

}  // namespace scolopax::kernel
