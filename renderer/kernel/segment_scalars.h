// SPDX-License-Identifier: Apache-2.0
// The scalars of all channels along a segment of every ray, as quadrature knows them: linear between two
// ends, or cubics. Objects of these types hold arrays that are indexed by variables, and nothing else: a
// device keeps such an object in memory as a whole.
#pragma once
#include "renderer/kernel/cubic.h"
#include "renderer/kernel/optical_curve.h"

namespace scolopax::kernel {

/// Positions of the channels at one end of a segment: of their values on their curves and, for classifiers
/// that need it, of |gradient| on the curve of the gradient factor. NaN where the value is not finite.
template <class L, class View>
struct SegmentEnd {
  CurvePoint<L> value[kMaxVisibleChannels];
  typename L::Float gradient[View::kFactors];
};

/// Positions that are linear between two ends.
template <class L, class View>
struct SegmentEnds {
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;

  SegmentEnd<L, View> from, to;

  /// The coordinate in which channel n and the knots of its curves are compared, at a fraction `along` of the
  /// segment and at a knot: the position on the curves.
  SCOLOPAX_LANES Float coordinateAt(int n, Float along) const {
    const Float p = from.value[n].position, q = to.value[n].position;
    const Mask known = isFinite(p), other = isFinite(q);
    const Float first = select(known, p, q);
    return first + along * (select(other, q, p) - first);
  }
  SCOLOPAX_LANES static Float coordinateOf(const Knots<L>& knot) { return knot.position; }
  /// Piece of the channel's curves at a coordinate.
  SCOLOPAX_LANES static Int pieceOf(const ChannelView& channel, Float coordinate) {
    return pointOn<L>(channel.optical, coordinate).piece;
  }
  /// Fraction of the segment, between two fractions, at which channel n has the coordinate `value`.
  SCOLOPAX_LANES Float fractionAt(int n, Float begin, Float end, Float value, Mask) const {
    const Float first = coordinateAt(n, begin), last = coordinateAt(n, end);
    return begin + (end - begin) * clamp((value - first) / (last - first), 0.0f, 1.0f);
  }
};

/// Scalars for y from -1 at a segment's start to 1 at its end: stored values (OpticalKnot::stored) and, for
/// classifiers that need it, the position of |gradient| on the curve of the gradient factor. NaN where a
/// value is not finite.
template <class L, class View>
struct SegmentCubics {
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;

  Cubic<L> value[kMaxVisibleChannels];
  Cubic<L> gradient[View::kFactors];

  /// As in SegmentEnds; the coordinate is the stored value.
  SCOLOPAX_LANES Float coordinateAt(int n, Float along) const { return value[n].at(2.0f * along - 1.0f); }
  SCOLOPAX_LANES static Float coordinateOf(const Knots<L>& knot) { return knot.stored; }
  SCOLOPAX_LANES static Int pieceOf(const ChannelView& channel, Float coordinate) {
    return pieceAt<L>(channel, coordinate);
  }
  SCOLOPAX_LANES Float fractionAt(int n, Float begin, Float end, Float wanted, Mask which) const {
    const Cubic<L>& f = value[n];
    const Float low = 2.0f * begin - 1.0f, high = 2.0f * end - 1.0f;
    return clamp(0.5f * (crossing(f, low, high, f.at(low), f.at(high), wanted, which) + 1.0f), begin, end);
  }
};

}  // namespace scolopax::kernel
