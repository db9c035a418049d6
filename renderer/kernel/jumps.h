// SPDX-License-Identifier: Apache-2.0
// The places on a segment at which a channel's curves jump. Where channels hide each other, quadrature takes
// extinctions to be linear between two points, and so must not step over a jump.
#pragma once
#include "renderer/kernel/point_segments.h"
#include "renderer/kernel/voxel_segments.h"

namespace scolopax::kernel {

/// Follows the channels of a segment, for rays in `which`, from jump to jump.
template <class L, class View, class Scalars>
class Jumps {
 public:
  /// A cubic passes each jump of a curve of 4096 points at most three times.
  static constexpr int kMostCuts = 3 << 12;
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Mask = typename L::Mask;

  /// `piece`: memory for a number per channel.
  SCOLOPAX_LANES Jumps(const View& scene, const Scalars& scalars, const Segment<L>& segment, Mask which,
                       Int* piece)
      : scene_(scene), scalars_(scalars), segment_(segment), piece_(piece) {
    cut_ = without(which, which);
    for (int n = 0; n < scene.channelCount; ++n) {
      if (!(segment.channels >> n & 1) || !scene.channels[n].optical.jumps || !any(which & segment.of(n)))
        continue;
      channels_ |= 1u << n;
      piece_[n] = pieceAlong(n, Float(0.0f));
    }
  }
  /// Shortens the parts of the rays in `on` that begin at `begin`, to the first jump up to `*end`. After
  /// kMostCuts parts, jumps are stepped over, so that no input makes a segment endless.
  SCOLOPAX_LANES void shorten(Float begin, Mask on, Float* end) {
    cut_ = without(on, on);
    if (++parts_ > kMostCuts) return;
    for (std::uint32_t left = channels_; left != 0; left &= left - 1) {
      const int n = lowestBit(left);
      const Int to = pieceAlong(n, *end);
      const Mask here = on & segment_.of(n), up = here & (to > piece_[n]), down = here & (piece_[n] > to);
      if (!any(up | down)) continue;
      Int knot = select(up, piece_[n] + Int(1), piece_[n]);
      const Mask jumps = find(scene_.channels[n].optical, up, down, to, &knot);
      if (!any(jumps)) continue;
      const Knots<L> at = knotsAt<L>(scene_.channels[n].optical, maximum(knot, Int(0)));
      const Float y = scalars_.fractionAt(n, begin, *end, scalars_.coordinateOf(at), jumps);
      const Mask first = jumps & (y <= *end);
      *end = select(first, y, *end);
      channel_ = select(first, Int(n), channel_);
      knot_ = select(first, knot, knot_);
      rises_ = select(first, onesOf(up), rises_);
      cut_ = cut_ | first;
    }
  }
  /// Rays that end their part at a jump of channel n.
  SCOLOPAX_LANES Mask at(int n) const { return cut_ & (channel_ == Int(n)); }
  SCOLOPAX_LANES bool found() const { return any(cut_); }
  /// Opacity and colour of channel n's curves at the jump: before it, or behind it.
  template <Detail kDetail>
  SCOLOPAX_LANES Optical<L> opticalAt(int n, bool behind) const {
    const OpticalCurveView& curve = scene_.channels[n].optical;
    const Int knot = behind ? knot_ + rises_ + rises_ - Int(1) : knot_;
    const Knots<L> at = knotsAt<L>(curve, maximum(minimum(knot, Int(curve.count - 1)), Int(0)));
    return {at.opacity, at.color};
  }
  /// Moves on to the place at which parts end.
  SCOLOPAX_LANES void advance(Float end) {
    for (std::uint32_t left = channels_; left != 0; left &= left - 1) {
      const int n = lowestBit(left);
      // The two knots of a jump have a piece between them.
      const Int beyond = knot_ + select(rises_ > Int(0), Int(1), Int(-2));
      piece_[n] = select(at(n), beyond, pieceAlong(n, end));
    }
  }

 private:
  SCOLOPAX_LANES Int pieceAlong(int n, Float along) const {
    return scalars_.pieceOf(scene_.channels[n], scalars_.coordinateAt(n, along));
  }
  /// Moves `*knot` to the first knot of a jump, up or down, before piece `to`. Returns where there is one.
  SCOLOPAX_LANES Mask find(const OpticalCurveView& curve, Mask up, Mask down, Int to, Int* knot) const {
    Mask found = without(up, up), seeking = up | down;
    for (int left = curve.count + 1; left > 0 && any(seeking); --left) {
      const Int lower = *knot - onesOf(down);  // of the two knots, if it is a jump
      const Mask inside = (lower > Int(-1)) & (Int(curve.count - 1) > lower);
      const Knots<L> a = knotsAt<L>(curve, maximum(minimum(lower, Int(curve.count - 1)), Int(0)));
      const Mask jumps = seeking & inside & (a.inverseWidth == 0.0f);
      found = found | jumps;
      seeking = without(seeking, jumps);
      *knot = *knot + where(seeking, onesOf(up) - onesOf(down));
      seeking = seeking & ((up & without(seeking, *knot > to)) | (down & (*knot > to)));
    }
    return found;
  }

  const View& scene_;
  const Scalars& scalars_;
  const Segment<L>& segment_;
  Int* const piece_;            // of each channel's curves
  std::uint32_t channels_ = 0;  // bit n: channel n may have jumps
  int parts_ = 0;
  Mask cut_;                             // rays whose part ends at a jump
  Int channel_{0}, knot_{0}, rises_{0};  // of the jump: reached at this knot, from below if `rises_` is 1
};

}  // namespace scolopax::kernel
