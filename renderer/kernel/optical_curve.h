// SPDX-License-Identifier: Apache-2.0
// Integrates the opacity and colour curves of a channel over a segment of a ray. The scalar is taken to be
// linear between two samples, and its piecewise-linear curves are integrated exactly (pre-integration: Engel,
// Kraus and Ertl 2001). Self-occlusion within the segment is ignored: colours are weighted by their
// extinction alone.
#pragma once
#include "renderer/kernel/classify.h"

namespace scolopax::kernel {

/// Position of a stored value on the curves. It may lie outside [0,1], up to kFarPosition from 0, so that it
/// is linear in the stored value and a segment that leaves the range is split where it does. With a gamma
/// other than 1, it is clamped to [0,1]. NaN where the value is not finite.
template <class Float>
SCOLOPAX_LANES Float stretchPosition(const ChannelView& channel, Float stored) {
  Float position =
      clamp((stored - channel.origin) * channel.scale + channel.offset, -kFarPosition, kFarPosition);
  if (channel.gamma != 1.0f) position = power(clamp(position, 0.0f, 1.0f), channel.gamma);
  return select(isFinite(stored), position, Float(kNaN));
}

/// Position on the curves of a stored value, as in OpticalKnot.
template <class L>
SCOLOPAX_LANES typename L::Float positionAt(const ChannelView& channel, typename L::Float stored) {
  using Float = typename L::Float;
  const float scale = magnitude(channel.scale);
  Float position = clamp(stored * scale + channel.offset, -kFarPosition, kFarPosition);
  if (channel.gamma != 1.0f) position = power(clamp(position, 0.0f, 1.0f), channel.gamma);
  return position;
}

/// One knot per lane.
template <class L>
struct Knots {
  typename L::Float position, inverseWidth, stored, opacity;
  typename L::Vec color;
};

/// The knot at each lane's index.
template <class L>
SCOLOPAX_LANES Knots<L> knotsAt(const OpticalCurveView& curve, typename L::Int index) {
  if constexpr (L::kLanes == 1) {
    const OpticalKnot& knot = curve.knots[index];
    return {knot.position, knot.inverseWidth, knot.stored, knot.opacity, knot.color};
  } else {
    const auto at = index * kKnotFloats;
    const OpticalKnot& knot = curve.knots[0];
    return {gather(&knot.position, at),
            gather(&knot.inverseWidth, at),
            gather(&knot.stored, at),
            gather(&knot.opacity, at),
            {gather(&knot.color.x, at), gather(&knot.color.y, at), gather(&knot.color.z, at)}};
  }
}
/// One knot, the same in all lanes.
template <class L>
SCOLOPAX_LANES Knots<L> knotAt(const OpticalCurveView& curve, int index) {
  using Float = typename L::Float;
  const OpticalKnot& knot = curve.knots[index];
  return {Float(knot.position), Float(knot.inverseWidth), Float(knot.stored), Float(knot.opacity),
          typename L::Vec(knot.color)};
}
template <class L>
SCOLOPAX_LANES typename L::Float knotPositions(const OpticalCurveView& curve, typename L::Int index) {
  if constexpr (L::kLanes == 1)
    return curve.knots[index].position;
  else
    return gather(&curve.knots[0].position, index * kKnotFloats);
}

/// A position on the curves, and the index of its piece. Piece k lies between knots k and k + 1. Before the
/// first knot (piece -1) and after the last (piece count - 1), the curves are constant.
template <class L>
struct CurvePoint {
  typename L::Float position;
  typename L::Int piece;
};

template <class L>
SCOLOPAX_LANES CurvePoint<L> pointOn(const OpticalCurveView& curve, typename L::Float position) {
  using Int = typename L::Int;
  using Mask = typename L::Mask;
  const Mask above = position >= 0.0f, inside = above & (position < 1.0f);
  // Bisection, because all knots may lie in one bucket.
  const Int bucket = truncated(where(inside, position) * float(kCurveBuckets));
  Int low = gather(curve.buckets, bucket), high = gather(curve.buckets, bucket + Int(1));
  for (Mask open = high > low; any(open); open = high > low) {
    const Int middle = rightSigned<1>(low + high + Int(1));
    const Mask behind = knotPositions<L>(curve, middle) <= position;
    low = select(open & behind, middle, low);
    high = select(without(open, behind), middle - Int(1), high);
  }
  return {position, select(inside, low, select(above, Int(curve.count - 1), Int(-1)))};
}
template <class L>
SCOLOPAX_LANES CurvePoint<L> select(typename L::Mask m, const CurvePoint<L>& a, const CurvePoint<L>& b) {
  return {select(m, a.position, b.position), select(m, a.piece, b.piece)};
}

/// Opacity and colour.
template <class L>
struct Optical {
  typename L::Float opacity;
  typename L::Vec color;
};

/// What to compute of a channel on a segment; each level includes those before it.
enum class Detail { extinction, emission, moment };

/// Opacity and colour at `position` on piece `piece`, which goes from knot a to knot b. At its right end, the
/// limit from the left.
template <Detail kDetail, class L>
SCOLOPAX_LANES Optical<L> opticalIn(const Knots<L>& a, const Knots<L>& b, typename L::Int piece,
                                    typename L::Float position) {
  using Float = typename L::Float;
  const Float t = where(piece > -1, minimum((position - a.position) * a.inverseWidth, Float(1.0f)));
  Optical<L> optical;
  optical.opacity = a.opacity + t * (b.opacity - a.opacity);
  if constexpr (kDetail >= Detail::emission) optical.color = a.color + t * (b.color - a.color);
  return optical;
}

/// The two knots of each lane's piece. If all lanes in `which` are on the same piece, only one pair is read.
template <class L>
SCOLOPAX_LANES void knotsOf(const OpticalCurveView& curve, typename L::Int piece, typename L::Mask which,
                            Knots<L>* a, Knots<L>* b) {
  using Int = typename L::Int;
  if constexpr (L::kLanes > 1) {
    const Int same = firstIn(which, piece);
    if (!any(without(which, piece == same))) {
      const int k = at(same, 0);
      *a = knotAt<L>(curve, k < 0 ? 0 : k);
      *b = knotAt<L>(curve, k < 0 ? 0 : k + 1 < curve.count ? k + 1 : k);
      return;
    }
  }
  const Int last = curve.count - 1;
  *a = knotsAt<L>(curve, maximum(piece, Int(0)));
  *b = knotsAt<L>(curve, maximum(minimum(piece + 1, last), Int(0)));
}

template <Detail kDetail, class L>
SCOLOPAX_LANES Optical<L> opticalAt(const OpticalCurveView& curve, const CurvePoint<L>& point,
                                    typename L::Mask which) {
  Knots<L> a, b;
  knotsOf<L>(curve, point.piece, which, &a, &b);
  return opticalIn<kDetail, L>(a, b, point.piece, point.position);
}

/// Contribution of a channel to a segment, as means over the segment: of its part of the visible extinction,
/// of that part times the colour, and of that part times the place in [0,1]. Per world unit. Means that
/// Detail does not include are 0.
template <class L>
struct PartOf {
  typename L::Float opacity;
  typename L::Vec emission;
  typename L::Float moment;
};
template <class L>
SCOLOPAX_LANES PartOf<L> noPart() {
  using Float = typename L::Float;
  return {Float(0.0f), typename L::Vec(0.0f), Float(0.0f)};
}
template <class L>
SCOLOPAX_LANES PartOf<L> scaled(const PartOf<L>& part, typename L::Float factor) {
  return {part.opacity * factor, part.emission * factor, part.moment * factor};
}
template <class L>
SCOLOPAX_LANES PartOf<L> sum(const PartOf<L>& a, const PartOf<L>& b) {
  return {a.opacity + b.opacity, a.emission + b.emission, a.moment + b.moment};
}

namespace detail {
/// Adds the part of a segment from place s to place e, on which both curves are linear. Exact.
template <Detail kDetail, class L>
SCOLOPAX_LANES void addLinear(const Optical<L>& a, const Optical<L>& b, typename L::Float s,
                              typename L::Float e, typename L::Mask which, PartOf<L>* means) {
  using Float = typename L::Float;
  const Float width = e - s, sixth = width * 0.166666667f;
  const Float left = 2.0f * a.opacity + b.opacity, right = a.opacity + 2.0f * b.opacity;
  means->opacity = means->opacity + where(which, width * 0.5f * (a.opacity + b.opacity));
  if constexpr (kDetail >= Detail::emission)
    for (int c = 0; c < 3; ++c)
      means->emission[c] =
          means->emission[c] + where(which, sixth * (left * a.color[c] + right * b.color[c]));
  if constexpr (kDetail >= Detail::moment)
    means->moment = means->moment + where(which, sixth * (left * s + right * e));
}

}  // namespace detail

/// Calls visit(a, b, piece, from, to, s, e, lanes) for every piece of the curve between p and q, which must
/// not be NaN. The piece lies between knots a and b, and the way from p to q covers positions `from` to `to`
/// of it, at places s to e in [0,1]. For lanes in `which`. Positions may lie outside [0,1], where the curve
/// is constant.
template <class L, class Visit>
SCOLOPAX_LANES void forEachPiece(const OpticalCurveView& curve, const CurvePoint<L>& p,
                                 const CurvePoint<L>& q, typename L::Mask which, Visit&& visit) {
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;
  const Int same = firstIn(which, p.piece);
  if (!any(without(which, (p.piece == same) & (q.piece == same)))) {
    const int k = at(same, 0);
    const Knots<L> a = knotAt<L>(curve, k < 0 ? 0 : k);
    const Knots<L> b = knotAt<L>(curve, k < 0 ? 0 : k + 1 < curve.count ? k + 1 : k);
    visit(a, b, p.piece, p.position, q.position, Float(0.0f), Float(1.0f), which);
    return;
  }
  const Int last = curve.count - 1;
  const Float scale = 1.0f / (q.position - p.position);
  const Mask up = q.piece > p.piece;
  const Int way = select(up, Int(1), Int(-1));
  Float from = p.position, place(0.0f);
  Int k = p.piece;
  for (Mask on = which; any(on);) {
    const Mask ends = k == q.piece;
    const Knots<L> a = knotsAt<L>(curve, minimum(maximum(k, Int(0)), last));
    const Knots<L> b = knotsAt<L>(curve, minimum(maximum(k + 1, Int(0)), last));
    const Float to = select(ends, q.position, select(up, b.position, a.position));
    const Float next = select(ends, Float(1.0f), clamp((to - p.position) * scale, place, 1.0f));
    visit(a, b, k, from, to, place, next, on & (place < next));
    from = to;
    place = next;
    k = k + way;
    on = without(on, ends);
  }
}

/// Means over a segment from p to q, which must not be NaN; 0 in lanes that are not in `which`.
template <Detail kDetail, class L>
SCOLOPAX_LANES PartOf<L> meansBetween(const OpticalCurveView& curve, const CurvePoint<L>& p,
                                      const CurvePoint<L>& q, typename L::Mask which) {
  using Float = typename L::Float;
  PartOf<L> means = noPart<L>();
  forEachPiece<L>(curve, p, q, which,
                  [&](const Knots<L>& a, const Knots<L>& b, typename L::Int piece, Float from, Float to,
                      Float s, Float e, typename L::Mask on) SCOLOPAX_LANES_LAMBDA {
                    detail::addLinear<kDetail, L>(opticalIn<kDetail, L>(a, b, piece, from),
                                                  opticalIn<kDetail, L>(a, b, piece, to), s, e, on, &means);
                  });
  return means;
}

/// Piece of the channel's curves at a stored value, as in OpticalKnot.
template <class L>
SCOLOPAX_LANES typename L::Int pieceAt(const ChannelView& channel, typename L::Float stored) {
  using Int = typename L::Int;
  const OpticalCurveView& curve = channel.optical;
  Int piece = pointOn<L>(curve, positionAt<L>(channel, stored)).piece;
  if (channel.gamma == 1.0f) return piece;
  // The position is rounded, and it is 0 for all values before the range.
  Knots<L> a, b;
  knotsOf<L>(curve, piece, L::everywhere(), &a, &b);
  piece = piece + onesOf((Int(curve.count - 1) > piece) & (stored >= b.stored)) -
          onesOf((piece > Int(-1)) & (stored < a.stored));
  return select(stored < curve.knots[0].stored, Int(-1), piece);
}

}  // namespace scolopax::kernel
