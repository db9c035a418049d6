// SPDX-License-Identifier: Apache-2.0
// A packet of rays at once: through pixels, into the box and through the macrocells. What
// kernel/camera_rays.h and kernel/cell_walk.h do with one; but the walk asks at points, instead of going from
// cell to cell.
#pragma once
#include "renderer/cpu/lanes.h"
#include "renderer/kernel/views.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

struct Rays {
  Float origin[3], direction[3];
};

/// kernel::CameraRays.
SCOLOPAX_SIMD Rays raysThrough(const kernel::CameraRays& camera, Float x, Float y) {
  const Float sx = (x - floats(camera.halfSize.x)) * floats(camera.pixelSize);
  const Float sy = (floats(camera.halfSize.y) - y) * floats(camera.pixelSize);
  const Float inverseLength =
      floats(1.0f) / squareRoot(floats(1.0f) + floats(camera.perspective) * (sx * sx + sy * sy));
  Rays rays;
  for (int axis = 0; axis < 3; ++axis) {
    rays.origin[axis] =
        floats(camera.origin0[axis]) + sx * floats(camera.originX[axis]) + sy * floats(camera.originY[axis]);
    rays.direction[axis] = (floats(camera.direction0[axis]) + sx * floats(camera.directionX[axis]) +
                            sy * floats(camera.directionY[axis])) *
                           inverseLength;
  }
  return rays;
}

/// Along the rays; a ray that is not in the mask meets nothing.
struct Intervals {
  Float enter, exit;
  Mask meets;
};

/// kernel::clipToBox.
SCOLOPAX_SIMD Intervals clipToBox(const Rays& rays, glm::ivec3 dims) {
  const Float zero = floats(0.0f), infinity = floats(kernel::kInfinity);
  Intervals inside{zero, infinity, zero == zero};
  for (int axis = 0; axis < 3; ++axis) {
    const Float lo = floats(-0.5f), hi = floats(float(dims[axis]) - 0.5f);
    const Float o = rays.origin[axis], d = rays.direction[axis];
    const Mask along = d == zero;
    const Float a = (lo - o) / d, b = (hi - o) / d;
    const Float near = minimum(a, b), far = maximum(a, b);
    inside.meets = inside.meets & (without(near <= far, along) | (along & (o >= lo) & (o <= hi)));
    inside.enter = select(along, inside.enter, maximum(inside.enter, near));
    inside.exit = select(along, inside.exit, minimum(inside.exit, far));
  }
  inside.meets = inside.meets & (inside.exit < infinity) & (inside.enter < inside.exit);
  return inside;
}

/// Finds what is not empty along every ray: asks cells at points, and walks on from there, a cube of empty
/// blocks as one step.
class PacketWalk {
 public:
  /// Only the part of the interval in which there are cells that are not empty. Where the grid has them, bits
  /// of `columns` say which channels matter.
  SCOLOPAX_SIMD PacketWalk(const Rays& rays, const Intervals& inside, const kernel::MajorantView& grid,
                           std::uint32_t columns)
      : rays_(rays), grid_(grid), inverseSize_(floats(1.0f / grid.cellSize)), end_(inside.exit) {
    enter_ = inside.enter;
    columns_ = ints(int(columns));
    active_ = ints(0);
    meets_ = inside.meets;
    for (int axis = 0; axis < 3; ++axis) {
      const Float o = rays.origin[axis], d = rays.direction[axis];
      up_[axis] = d > floats(0.0f);
      const Mask along = d == floats(0.0f);
      last_[axis] = select(along, ints(-1), ints(grid.cells[axis] - 1));
      inverse_[axis] =
          clamp(floats(1.0f) / d, floats(-kernel::kLargestFinite), floats(kernel::kLargestFinite));
      // Rounding must not take anything away.
      constexpr float kMargin = 0.0625f;
      const Float lo = floats(float(grid.filledLow[axis]) * grid.cellSize - kMargin);
      const Float hi = floats(float(grid.filledHigh[axis]) * grid.cellSize + kMargin);
      if (grid.filledLow[axis] > 0) narrow(up_[axis], along, (lo - o) * inverse_[axis], o >= lo);
      if (grid.filledHigh[axis] < grid.cells[axis])
        narrow(without(d < floats(0.0f), along), along, (hi - o) * inverse_[axis], o <= hi);
    }
    meets_ = meets_ & (enter_ < end_);
    for (int axis = 0; axis < 3; ++axis) cell_[axis] = cellAt(axis, enter_);
    ask();
  }

  SCOLOPAX_SIMD Mask meets() const { return meets_; }
  /// Up to here there is nothing, but what was asked before.
  SCOLOPAX_SIMD Float enter() const { return enter_; }
  /// Rays whose cell at enter() may have extinction.
  SCOLOPAX_SIMD Mask full() const { return full_; }
  /// Bits of the columns that may have extinction there; only where the grid has them.
  SCOLOPAX_SIMD Int active() const { return active_; }
  /// Where the cells of enter(), or the cubes of empty blocks around them, end; infinite when nothing is
  /// left.
  SCOLOPAX_SIMD Float exit() const { return exit_; }

  /// Asks at t where that is further.
  SCOLOPAX_SIMD void jump(Float t) {
    const Mask further = t > enter_;
    enter_ = maximum(t, enter_);
    for (int axis = 0; axis < 3; ++axis) cell_[axis] = select(further, cellAt(axis, t), cell_[axis]);
    ask();
  }

  /// Finds out exit(); before advance().
  SCOLOPAX_SIMD void measure() {
    const Int one = ints(1);
    const Int radius = code_ - ints(kernel::kEmptyCode);
    const Mask wide = radius > ints(0);
    exit_ = end_;
    for (int axis = 0; axis < 3; ++axis) {
      const Int block = rightSigned<kShift>(cell_[axis]);
      const Int side = block + select(up_[axis], radius, one - radius);
      const Int ahead = onesOf(up_[axis]);
      const Int plane = select(wide, left<kShift>(side), cell_[axis] + ahead);
      next_[axis] = plane + ahead - one;
      const Mask leaves = without(next_[axis] > ints(-1), next_[axis] > last_[axis]);
      const Float t = (toFloat(plane) * floats(grid_.cellSize) - rays_.origin[axis]) * inverse_[axis];
      through_[axis] = maximum(select(leaves, t, floats(kernel::kInfinity)), enter_);
      exit_ = minimum(through_[axis], exit_);
    }
    exit_ = select(exit_ < end_, maximum(exit_, enter_), floats(kernel::kInfinity));
  }

  /// These rays, which have something left, go where their cells or cubes end.
  SCOLOPAX_SIMD void advance(Mask which) {
    const Float t = exit_;
    enter_ = select(which, t, enter_);
    Mask first = which;  // a ray leaves through one axis: the first of those that are as near
    for (int axis = 0; axis < 3; ++axis) {
      const Mask out = first & (through_[axis] <= t);
      first = without(first, out);
      // Never back, so that no input makes a walk endless.
      const Int least = minimum(cell_[axis], next_[axis] + ints(1));
      const Int most = maximum(cell_[axis], next_[axis] - ints(1));
      const Int across = minimum(maximum(cellAt(axis, t), least), most);
      cell_[axis] = select(which, select(out, next_[axis], across), cell_[axis]);
    }
    ask();
  }

 private:
  static constexpr int kShift = 2;
  static_assert(kernel::kBlockEdge == 1 << kShift);

  /// The interval begins (or else ends) at t; along the plane, rays are on the right side or see nothing.
  SCOLOPAX_SIMD void narrow(Mask begins, Mask along, Float t, Mask right) {
    enter_ = select(begins, maximum(enter_, t), enter_);
    end_ = select(begins | along, end_, minimum(end_, t));
    meets_ = without(meets_, without(along, right));
  }
  SCOLOPAX_SIMD Int cellAt(int axis, Float t) const {
    const Float at = (rays_.origin[axis] + t * rays_.direction[axis]) * inverseSize_;
    return truncated(clamp(at, floats(0.0f), floats(float(grid_.cells[axis] - 1))));
  }
  SCOLOPAX_SIMD void ask() {
    const Int index = (cell_[2] * ints(grid_.cells.y) + cell_[1]) * ints(grid_.cells.x) + cell_[0];
    code_ = gather(grid_.totals, index);
    full_ = (code_ > ints(0)) & (ints(kernel::kEmptyCode) > code_);
    if (!grid_.active) return;
    active_ = gather(grid_.active, index) & columns_;
    full_ = without(full_, active_ == ints(0));
  }

  const Rays& rays_;
  const kernel::MajorantView& grid_;
  Float inverseSize_, end_, enter_, exit_;
  Mask meets_, full_;
  Mask up_[3];
  Float inverse_[3], through_[3];
  Int columns_, code_, active_;
  Int cell_[3], last_[3], next_[3];  // next: behind the plane through which a ray may leave
};

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
