// SPDX-License-Identifier: Apache-2.0
// Contribution of one channel to a segment inside one cell of eight voxels, where its scalar is a cubic: the
// segment is divided where the scalar turns and where it meets a knot of the curves.
#pragma once
#include "renderer/kernel/cubic.h"
#include "renderer/kernel/gradient.h"
#include "renderer/kernel/optical_curve.h"

namespace scolopax::kernel {

/// The channels' scalars along a segment of every ray, for y from -1 at its start to 1 at its end: as stored
/// values (OpticalKnot::stored) and, for channels with a gradient factor, as positions of |gradient| on the
/// factor's curve. NaN where a value is not finite. As with SegmentEnds, arrays that are indexed by
/// variables.
template <class L, class View>
struct SegmentCubics {
  Cubic<L> stored[kMaxVisibleChannels];
  Cubic<L> factorPosition[View::kFactors];
};

/// A cubic that moves along a curve, from piece to piece.
template <class L>
class CurveWalk {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;

  /// Begins at y = -1 on the given piece.
  SCOLOPAX_LANES CurveWalk(const OpticalCurveView& curve, const Cubic<L>& f, Int piece)
      : curve_(curve), f_(f), turns_(turnsOf(f)), at_(f.at(Float(-1.0f))), piece_(piece) {}

  /// Finds where the curve's piece ends or the cubic turns, after `from`; at 1 at the latest. For lanes in
  /// `which`. Between two turns, the cubic meets every knot at most once.
  SCOLOPAX_LANES Float findEnd(Float from, Mask which) {
    const Float last(1.0f);
    Float end = select(turns_.first > from, turns_.first, select(turns_.second > from, turns_.second, last));
    atEnd_ = f_.at(end);
    knotsOf<L>(curve_, piece_, which, &a_, &b_);
    above_ = which & (Int(curve_.count - 1) > piece_) & (atEnd_ > b_.stored);
    below_ = which & (piece_ > Int(-1)) & (atEnd_ < a_.stored);
    const Mask meets = above_ | below_;
    if (any(meets)) {
      const Float knot = select(above_, b_.stored, a_.stored);
      end = select(meets, crossing(f_, from, end, at_, atEnd_, knot, meets), end);
      atEnd_ = select(meets, knot, atEnd_);
    }
    return end;
  }
  /// Moves to `to`; to the next piece where that is the end that was found and the piece ends there. Returns
  /// where it does.
  SCOLOPAX_LANES Mask moveTo(Float to, Mask isEnd, Mask which) {
    const Mask up = above_ & isEnd & which, down = below_ & isEnd & which;
    at_ = select(which, select(isEnd, atEnd_, f_.at(to)), at_);
    piece_ = piece_ + onesOf(up) - onesOf(down);
    return up | down;
  }
  /// On the current piece, at y.
  template <Detail kDetail>
  SCOLOPAX_LANES Optical<L> opticalAt(Float position) const {
    return opticalIn<kDetail, L>(a_, b_, piece_, position);
  }
  SCOLOPAX_LANES const Cubic<L>& cubic() const { return f_; }

 private:
  const OpticalCurveView& curve_;
  const Cubic<L>& f_;
  Turns<L> turns_;
  Float at_, atEnd_{0.0f};
  Int piece_;
  Knots<L> a_, b_;  // of the piece
  Mask above_, below_;
};

/// Adds the part of a segment from `from` to `to`, where extinctions are opacities of `optical(y)`. Gauss's
/// rule with three points: exact for an extinction that is linear in a cubic, and almost for its emission,
/// which is of degree 6.
template <Detail kDetail, class L, class OpticalOf>
SCOLOPAX_LANES void addCubicPiece(typename L::Float from, typename L::Float to, typename L::Mask which,
                                  const OpticalOf& opticalOf, PartOf<L>* means) {
  using Float = typename L::Float;
  const Float middle = 0.5f * (from + to), half = 0.5f * (to - from), away = half * 0.774596669f;
  for (int i = -1; i <= 1; ++i) {
    const Float y = middle + float(i) * away;
    const Optical<L> optical = opticalOf(y);
    const Float weighted = where(which, half * (i == 0 ? 0.444444444f : 0.277777778f) * optical.opacity);
    means->opacity = means->opacity + weighted;
    if constexpr (kDetail >= Detail::emission) means->emission = means->emission + weighted * optical.color;
    if constexpr (kDetail >= Detail::moment) means->moment = means->moment + weighted * (0.5f * (y + 1.0f));
  }
}

/// Piece of the channel's curves at a stored value, as in OpticalKnot.
template <class L>
SCOLOPAX_LANES typename L::Int pieceAt(const ChannelView& channel, typename L::Float stored) {
  using Int = typename L::Int;
  const OpticalCurveView& curve = channel.optical;
  Int piece = pointOn<L>(curve, positionAt<L>(channel, stored)).piece;
  if (channel.gamma == 1.0f) return piece;
  // The position is rounded, and it is 0 at all places before the range.
  Knots<L> a, b;
  knotsOf<L>(curve, piece, L::everywhere(), &a, &b);
  piece = piece + onesOf((Int(curve.count - 1) > piece) & (stored >= b.stored)) -
          onesOf((piece > Int(-1)) & (stored < a.stored));
  return select(stored < curve.knots[0].stored, Int(-1), piece);
}

/// Means over a segment on which the scalar is the cubic `f`; 0 in lanes that are not in `which`.
template <Detail kDetail, class L>
SCOLOPAX_LANES PartOf<L> meansOfCubic(const ChannelView& channel, const Cubic<L>& f, typename L::Mask which) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  CurveWalk<L> walk(channel.optical, f, pieceAt<L>(channel, f.at(Float(-1.0f))));
  PartOf<L> means = noPart<L>();
  Float from(-1.0f);
  Mask on = which;
  for (int left = 3 * channel.optical.count + 4; left > 0 && any(on); --left) {
    const Float to = walk.findEnd(from, on);
    addCubicPiece<kDetail, L>(
        from, to, on,
        [&](Float y) SCOLOPAX_LANES_LAMBDA {
          return walk.template opticalAt<kDetail>(positionAt<L>(channel, f.at(y)));
        },
        &means);
    const Mask meets = walk.moveTo(to, L::everywhere(), on);
    from = select(on, to, from);
    on = without(on, without(from >= 1.0f, meets));
  }
  return means;
}

/// The same with the gradient factor of the channel, whose position is the cubic `g`.
template <Detail kDetail, class L>
SCOLOPAX_LANES_RARE void findMeansWithFactor(const ChannelView& channel, const Cubic<L>& f, const Cubic<L>& g,
                                             const typename L::Mask& which, PartOf<L>* means) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  const OpticalCurveView& factor = channel.factor.optical;
  const Float begin(-1.0f);
  CurveWalk<L> walk(channel.optical, f, pieceAt<L>(channel, f.at(begin)));
  CurveWalk<L> ofFactor(factor, g, pointOn<L>(factor, g.at(begin)).piece);
  *means = noPart<L>();
  Float from = begin;
  Mask on = which;
  for (int left = 3 * (channel.optical.count + factor.count) + 8; left > 0 && any(on); --left) {
    const Float own = walk.findEnd(from, on), other = ofFactor.findEnd(from, on), to = minimum(own, other);
    addCubicPiece<kDetail, L>(
        from, to, on,
        [&](Float y) SCOLOPAX_LANES_LAMBDA {
          Optical<L> optical = walk.template opticalAt<kDetail>(positionAt<L>(channel, f.at(y)));
          optical.opacity =
              optical.opacity * ofFactor.template opticalAt<Detail::extinction>(g.at(y)).opacity;
          return optical;
        },
        means);
    const Mask meets = walk.moveTo(to, own <= other, on) | ofFactor.moveTo(to, other <= own, on);
    from = select(on, to, from);
    on = without(on, without(from >= 1.0f, meets));
  }
}

/// Part of channel n on a segment, as if it were the only channel; nothing for rays that are not in `which`.
template <Detail kDetail, class L, class View>
SCOLOPAX_LANES PartOf<L> partAlone(const View& scene, const SegmentCubics<L, View>& scalars, int n,
                                   typename L::Mask which) {
  using Mask = typename L::Mask;
  const ChannelView& channel = scene.channels[n];
  const OpticalCurveView& curve = channel.optical;
  const Cubic<L>& f = scalars.stored[n];
  const CubicBounds<L> bounds = boundsOf(f);
  const Mask outside = (positionAt<L>(channel, bounds.upper) <= curve.first) |
                       (positionAt<L>(channel, bounds.lower) >= curve.last);
  Mask seen = without(which & isFinite(f.c0), outside);
  PartOf<L> means;
  if (scene.hasFactor(n)) [[unlikely]] {
    const Cubic<L>& factorPosition = scalars.factorPosition[n];
    seen = seen & isFinite(factorPosition.c0);
    if (!any(seen)) return noPart<L>();
    findMeansWithFactor<kDetail, L>(channel, f, factorPosition, seen, &means);
  } else {
    if (!any(seen)) return noPart<L>();
    means = meansOfCubic<kDetail, L>(channel, f, seen);
  }
  return scaled(means, channel.density);
}

/// Multiplies an opacity by the gradient factor at a position.
template <class L>
SCOLOPAX_LANES_RARE void multiplyByFactorAt(const ChannelView& channel, const typename L::Float& position,
                                            const typename L::Mask& which, typename L::Float* opacity) {
  const OpticalCurveView& curve = channel.factor.optical;
  *opacity = *opacity * opticalAt<Detail::extinction, L>(curve, pointOn<L>(curve, position), which).opacity;
}

/// Extinction of channel n at a fraction `along` of a segment, where its curve has the given opacity.
template <class L, class View>
SCOLOPAX_LANES typename L::Float extinctionOn(const View& scene, const SegmentCubics<L, View>& scalars, int n,
                                              typename L::Float along, typename L::Mask which,
                                              typename L::Float opacity) {
  const ChannelView& channel = scene.channels[n];
  typename L::Mask known = isFinite(scalars.stored[n].c0);
  if (scene.hasFactor(n)) [[unlikely]] {
    const Cubic<L>& g = scalars.factorPosition[n];
    known = known & isFinite(g.c0);
    multiplyByFactorAt<L>(channel, g.at(2.0f * along - 1.0f), which, &opacity);
  }
  return where(known, opacity * channel.density);
}

/// Extinction (as `opacity`) and colour of channel n at a fraction `along` of a segment. Undefined for rays
/// that are not in `which`.
template <Detail kDetail, class L, class View>
SCOLOPAX_LANES Optical<L> opticalOn(const View& scene, const SegmentCubics<L, View>& scalars, int n,
                                    typename L::Float along, typename L::Mask which) {
  const ChannelView& channel = scene.channels[n];
  const auto position = positionAt<L>(channel, scalars.stored[n].at(2.0f * along - 1.0f));
  Optical<L> optical = opticalAt<kDetail, L>(channel.optical, pointOn<L>(channel.optical, position), which);
  optical.opacity = extinctionOn(scene, scalars, n, along, which, optical.opacity);
  return optical;
}

/// Rays for which the extinction of channel n is linear on the segment.
template <class L, class View>
SCOLOPAX_LANES typename L::Mask isStraight(const View&, const SegmentCubics<L, View>&, int) {
  return without(L::everywhere(), L::everywhere());
}

}  // namespace scolopax::kernel
