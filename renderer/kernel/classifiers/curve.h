// SPDX-License-Identifier: Apache-2.0
// The classifier of channels whose opacity and colour depend on the value alone, along curves.
#pragma once
#include "renderer/kernel/gradient.h"
#include "renderer/kernel/sample_records.h"
#include "renderer/kernel/segment_cubics.h"

namespace scolopax::kernel {

/// Opacity of the curves' position at a fraction `along` of a segment, and their colour. Undefined for rays
/// that are not in `which`.
template <Detail kDetail, class L, class View>
SCOLOPAX_LANES Optical<L> curvesOn(const ChannelView& channel, const SegmentEnds<L, View>& ends, int n,
                                   typename L::Float along, typename L::Mask which) {
  using Mask = typename L::Mask;
  const CurvePoint<L>& from = ends.from.value[n];
  const CurvePoint<L>& to = ends.to.value[n];
  const Mask known = from.position == from.position, other = to.position == to.position;
  const CurvePoint<L> p = select(known, from, to), q = select(other, to, from);
  CurvePoint<L> point{p.position + along * (q.position - p.position), p.piece};
  if (any(without(which, p.piece == q.piece))) point = pointOn<L>(channel.optical, point.position);
  return opticalAt<kDetail, L>(channel.optical, point, which);
}
template <Detail kDetail, class L, class View>
SCOLOPAX_LANES Optical<L> curvesOn(const ChannelView& channel, const SegmentCubics<L, View>& cubics, int n,
                                   typename L::Float along, typename L::Mask which) {
  const auto position = positionAt<L>(channel, cubics.value[n].at(2.0f * along - 1.0f));
  return opticalAt<kDetail, L>(channel.optical, pointOn<L>(channel.optical, position), which);
}

/// classifiers.h says what each function does.
struct Curve {
  SCOLOPAX_HD static unsigned fetches(const FieldView&, glm::ivec3) { return 0; }

  SCOLOPAX_HD static float extinctionAt(const ChannelView& channel, glm::ivec3, glm::vec3, float position,
                                        SampleCost*) {
    return kernel::extinctionAt(channel, position);
  }

  struct Nearby {
    SCOLOPAX_HD Nearby(const ChannelView& channel, glm::ivec3, glm::ivec3, glm::vec3, glm::vec3)
        : channel_(channel) {}
    SCOLOPAX_HD bool finite() const { return true; }
    SCOLOPAX_HD float at(float stored) const {
      return kernel::extinctionAt(channel_, curvePosition(channel_, stored));
    }
    SCOLOPAX_HD float bound(float lo, float hi, float) const { return largestExtinction(channel_, lo, hi); }

   private:
    const ChannelView& channel_;
  };

  template <class L, class View>
  SCOLOPAX_LANES static void sample(const ChannelView& channel, glm::ivec3, const typename L::Vec&,
                                    typename L::Float stored, int n, SegmentEnd<L, View>& end) {
    end.value[n] = pointOn<L>(channel.optical, stretchPosition(channel, stored));
  }
  template <class L, class View>
  SCOLOPAX_LANES static void passOn(int n, SegmentEnds<L, View>& ends) {
    ends.from.value[n] = ends.to.value[n];
  }

  template <class L, class View>
  SCOLOPAX_LANES static void sample(const ChannelView& channel, glm::ivec3, const typename L::Vec*,
                                    const typename L::Float* stored, typename L::Mask which, int n,
                                    SegmentCubics<L, View>& cubics) {
    typename L::Float own[kCubicNodes];
    for (int i = 0; i < kCubicNodes; ++i) own[i] = channel.scale < 0.0f ? -stored[i] : stored[i];
    cubics.value[n] = select<L>(which, cubicThrough<L>(own), cubics.value[n]);
  }
  template <class L, class View>
  SCOLOPAX_LANES static void cutPart(const SegmentCubics<L, View>& whole, typename L::Float middle,
                                     typename L::Float half, int n, SegmentCubics<L, View>& part) {
    part.value[n] = partOf<L>(whole.value[n], middle, half);
  }

  /// If only one end of the segment has a finite value, only half of the segment counts.
  template <Detail kDetail, class L, class View>
  SCOLOPAX_LANES static PartOf<L> partAlone(const ChannelView& channel, const SegmentEnds<L, View>& ends,
                                            int n, typename L::Mask which) {
    using Float = typename L::Float;
    using Mask = typename L::Mask;
    const OpticalCurveView& curve = channel.optical;
    CurvePoint<L> from = ends.from.value[n], to = ends.to.value[n];
    Float density(channel.density);
    if (!channel.field.finite) {
      const Mask known = from.position == from.position, other = to.position == to.position;
      const CurvePoint<L> start = select(known, from, to);
      to = select(other, to, from);
      from = start;
      density = select(known & other, density, 0.5f * density);
      which = which & (known | other);
    }
    const Float p = from.position, q = to.position;
    const Mask outside = ((p <= curve.first) & (q <= curve.first)) | ((p >= curve.last) & (q >= curve.last));
    const Mask seen = without(which, outside);
    if (!any(seen)) return noPart<L>();
    return scaled(meansBetween<kDetail, L>(curve, from, to, seen), density);
  }
  template <Detail kDetail, class L, class View>
  SCOLOPAX_LANES static PartOf<L> partAlone(const ChannelView& channel, const SegmentCubics<L, View>& cubics,
                                            int n, typename L::Mask which) {
    const typename L::Mask seen = meetsCurve(channel, cubics.value[n], which);
    if (!any(seen)) return noPart<L>();
    return scaled(meansOfCubic<kDetail, L>(channel, cubics.value[n], seen), channel.density);
  }

  template <class L, class View>
  SCOLOPAX_LANES static typename L::Float extinctionOn(const ChannelView& channel,
                                                       const SegmentEnds<L, View>& ends, int n,
                                                       typename L::Float, typename L::Mask,
                                                       typename L::Float opacity) {
    const auto p = ends.from.value[n].position, q = ends.to.value[n].position;
    return where(isFinite(p) | isFinite(q), opacity * channel.density);
  }
  template <class L, class View>
  SCOLOPAX_LANES static typename L::Float extinctionOn(const ChannelView& channel,
                                                       const SegmentCubics<L, View>& cubics, int n,
                                                       typename L::Float, typename L::Mask,
                                                       typename L::Float opacity) {
    return where(isFinite(cubics.value[n].c0), opacity * channel.density);
  }

  template <class L, class View>
  SCOLOPAX_LANES static typename L::Mask isStraight(const ChannelView&, const SegmentEnds<L, View>& ends,
                                                    int n) {
    return ends.from.value[n].piece == ends.to.value[n].piece;
  }
  template <class L, class View>
  SCOLOPAX_LANES static typename L::Mask isStraight(const ChannelView&, const SegmentCubics<L, View>&, int) {
    return without(L::everywhere(), L::everywhere());
  }

  /// Rays in `which` for which the cubic is finite and may take values with opacity.
  template <class L>
  SCOLOPAX_LANES static typename L::Mask meetsCurve(const ChannelView& channel, const Cubic<L>& f,
                                                    typename L::Mask which) {
    const OpticalCurveView& curve = channel.optical;
    const CubicBounds<L> bounds = boundsOf(f);
    const typename L::Mask outside = (positionAt<L>(channel, bounds.upper) <= curve.first) |
                                     (positionAt<L>(channel, bounds.lower) >= curve.last);
    return without(which & isFinite(f.c0), outside);
  }
};

}  // namespace scolopax::kernel
