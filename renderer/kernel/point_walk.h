// SPDX-License-Identifier: Apache-2.0
// The way of a ray a lane through the macrocells. Where cell_walk.h goes from cell to cell, this asks at
// points and leaps from there, so that rays keep step.
#pragma once
#include "renderer/kernel/cell_walk.h"

namespace scolopax::kernel {

/// Finds what is not empty along every ray: asks cells at points, and walks on from there, a cube of empty
/// blocks as one step.
template <class L>
class PointWalk {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Word = typename L::Word;
  using Mask = typename L::Mask;

  /// Only the part of the interval in which there are cells that are not empty. Where the grid has bits of
  /// channels, those of `channels` matter.
  SCOLOPAX_LANES PointWalk(const RayOf<L>& rays, const IntervalOf<L>& inside, const MajorantView& grid,
                           Word channels)
      : rays_(rays), grid_(grid), inverseSize_(1.0f / grid.cellSize), end_(inside.exit) {
    enter_ = inside.enter;
    channels_ = channels;
    active_ = Word(0u);
    meets_ = inside.enter < inside.exit;
    for (int axis = 0; axis < 3; ++axis) {
      const Float o = rays.origin[axis], d = rays.direction[axis];
      up_[axis] = d > 0.0f;
      const Mask along = d == 0.0f;
      last_[axis] = select(along, Int(-1), Int(grid.cells[axis] - 1));
      inverse_[axis] = clamp(1.0f / d, -kLargestFinite, kLargestFinite);
      // Rounding must not take anything away.
      constexpr float kMargin = 0.0625f;
      const float lo = float(grid.filledLow[axis]) * grid.cellSize - kMargin;
      const float hi = float(grid.filledHigh[axis]) * grid.cellSize + kMargin;
      if (grid.filledLow[axis] > 0) narrow(up_[axis], along, (lo - o) * inverse_[axis], o >= lo);
      if (grid.filledHigh[axis] < grid.cells[axis])
        narrow(without(d < 0.0f, along), along, (hi - o) * inverse_[axis], o <= hi);
    }
    meets_ = meets_ & (enter_ < end_);
    for (int axis = 0; axis < 3; ++axis) cell_[axis] = cellAt(axis, enter_);
    ask();
  }

  SCOLOPAX_LANES Mask meets() const { return meets_; }
  /// Up to here there is nothing, but what was asked before.
  SCOLOPAX_LANES Float enter() const { return enter_; }
  /// Rays whose cell at enter() may have extinction.
  SCOLOPAX_LANES Mask full() const { return full_; }
  /// Bits of the channels that may have extinction there; only where the grid has them.
  SCOLOPAX_LANES Word active() const { return active_; }
  /// Where the cells of enter(), or the cubes of empty blocks around them, end; infinite when nothing is
  /// left.
  SCOLOPAX_LANES Float exit() const { return exit_; }

  /// Asks at t where that is further.
  SCOLOPAX_LANES void jump(Float t) {
    const Mask further = t > enter_;
    enter_ = maximum(t, enter_);
    for (int axis = 0; axis < 3; ++axis) cell_[axis] = select(further, cellAt(axis, t), cell_[axis]);
    ask();
  }

  /// Finds out exit(); before advance().
  SCOLOPAX_LANES void measure() {
    const Int one = Int(1);
    const Int radius = code_ - Int(kEmptyCode);
    const Mask wide = radius > Int(0);
    exit_ = end_;
    for (int axis = 0; axis < 3; ++axis) {
      const Int block = rightSigned<kShift>(cell_[axis]);
      const Int side = block + select(up_[axis], radius, one - radius);
      const Int ahead = onesOf(up_[axis]);
      const Int plane = select(wide, left<kShift>(side), cell_[axis] + ahead);
      next_[axis] = plane + ahead - one;
      const Mask leaves = without(next_[axis] > Int(-1), next_[axis] > last_[axis]);
      const Float t = (toFloat(plane) * grid_.cellSize - rays_.origin[axis]) * inverse_[axis];
      through_[axis] = maximum(select(leaves, t, Float(kInfinity)), enter_);
      exit_ = minimum(through_[axis], exit_);
    }
    exit_ = select(exit_ < end_, maximum(exit_, enter_), Float(kInfinity));
  }

  /// These rays, which have something left, go where their cells or cubes end.
  SCOLOPAX_LANES void advance(Mask which) {
    const Float t = exit_;
    enter_ = select(which, t, enter_);
    Mask first = which;  // a ray leaves through one axis: the first of those that are as near
    for (int axis = 0; axis < 3; ++axis) {
      const Mask out = first & (through_[axis] <= t);
      first = without(first, out);
      // Never back, so that no input makes a walk endless.
      const Int least = minimum(cell_[axis], next_[axis] + Int(1));
      const Int most = maximum(cell_[axis], next_[axis] - Int(1));
      const Int across = minimum(maximum(cellAt(axis, t), least), most);
      cell_[axis] = select(which, select(out, next_[axis], across), cell_[axis]);
    }
    ask();
  }

 private:
  static constexpr int kShift = 2;
  static_assert(kBlockEdge == 1 << kShift);

  /// The interval begins (or else ends) at t; along the plane, rays are on the right side or see nothing.
  SCOLOPAX_LANES void narrow(Mask begins, Mask along, Float t, Mask right) {
    enter_ = select(begins, maximum(enter_, t), enter_);
    end_ = select(begins | along, end_, minimum(end_, t));
    meets_ = without(meets_, without(along, right));
  }
  SCOLOPAX_LANES Int cellAt(int axis, Float t) const {
    const Float at = (rays_.origin[axis] + t * rays_.direction[axis]) * inverseSize_;
    return truncated(clamp(at, 0.0f, float(grid_.cells[axis] - 1)));
  }
  SCOLOPAX_LANES void ask() {
    const Int index = (cell_[2] * Int(grid_.cells.y) + cell_[1]) * Int(grid_.cells.x) + cell_[0];
    code_ = Int(gather(grid_.totals, index));
    full_ = (code_ > Int(0)) & (Int(kEmptyCode) > code_);
    if (!grid_.active) return;
    active_ = gather(grid_.active, index) & channels_;
    full_ = without(full_, active_ == Word(0u));
  }

  const RayOf<L>& rays_;
  const MajorantView& grid_;
  Float inverseSize_, end_, enter_, exit_;
  Mask meets_, full_;
  Mask up_[3];
  Float inverse_[3], through_[3];
  Word channels_, active_;
  Int code_;
  Int cell_[3], last_[3], next_[3];  // next: behind the plane through which a ray may leave
};

}  // namespace scolopax::kernel
