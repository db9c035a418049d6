// SPDX-License-Identifier: Apache-2.0
// Traverses the macrocells along one ray per lane. Unlike cell_walk.h, which goes from cell to cell, it looks
// up cells at given points and leaps from there, so that the rays stay in lockstep.
#pragma once
#include "renderer/kernel/cell_walk.h"

namespace scolopax::kernel {

/// Finds the non-empty cells along every ray. Looks up the cell at a point and advances from there, with a
/// cube of empty blocks as one step.
template <class L>
class PointWalk {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Word = typename L::Word;
  using Mask = typename L::Mask;

  /// Reduces the interval to the part that may have non-empty cells. If the grid has MajorantView::active,
  /// cells without any of `channels` count as empty.
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
      // Rounding must not cut off any non-empty cell.
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
  /// The point looked up last. Everything before it is empty, except what was looked up earlier.
  SCOLOPAX_LANES Float enter() const { return enter_; }
  /// Rays whose cell at enter() may have extinction.
  SCOLOPAX_LANES Mask full() const { return full_; }
  /// Bits of the channels that may have extinction there; only if the grid has MajorantView::active.
  SCOLOPAX_LANES Word active() const { return active_; }
  /// Where rays leave the cells at enter(), or the cubes of empty blocks around them; infinite if nothing is
  /// left.
  SCOLOPAX_LANES Float exit() const { return exit_; }

  /// Moves forward to t where t is further, and looks up the cells there.
  SCOLOPAX_LANES void jump(Float t) {
    const Mask further = t > enter_;
    enter_ = maximum(t, enter_);
    for (int axis = 0; axis < 3; ++axis) cell_[axis] = select(further, cellAt(axis, t), cell_[axis]);
    ask();
  }

  /// Computes exit(). Call before advance().
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

  /// Moves the rays in `which` to exit(), which must be finite, and looks up the cells there.
  SCOLOPAX_LANES void advance(Mask which) {
    const Float t = exit_;
    enter_ = select(which, t, enter_);
    Mask first = which;  // a ray leaves through one axis: the first of equally near ones
    for (int axis = 0; axis < 3; ++axis) {
      const Mask out = first & (through_[axis] <= t);
      first = without(first, out);
      // Never backwards, so that no input makes a walk endless.
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

  /// Moves the start of the interval, or its end where `begins` is false, to t. Rays that are parallel to the
  /// plane (`along`) must be on its inner side (`right`), or they miss everything.
  SCOLOPAX_LANES void narrow(Mask begins, Mask along, Float t, Mask right) {
    enter_ = select(begins, maximum(enter_, t), enter_);
    end_ = select(begins | along, end_, minimum(end_, t));
    meets_ = without(meets_, without(along, right));
  }
  SCOLOPAX_LANES Int cellAt(int axis, Float t) const {
    return macrocellAt<L>(rays_, t, axis, inverseSize_, grid_);
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
  Int cell_[3], last_[3], next_[3];  // next_: the cell behind the plane through which a ray may leave
};

}  // namespace scolopax::kernel
