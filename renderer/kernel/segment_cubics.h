// SPDX-License-Identifier: Apache-2.0
// Integrates the curves of a channel over a segment on which its scalar is a cubic: the segment is divided
// where the scalar turns and where it meets a knot of the curves.
#pragma once
#include "renderer/kernel/segment_scalars.h"

namespace scolopax::kernel {

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

}  // namespace scolopax::kernel
