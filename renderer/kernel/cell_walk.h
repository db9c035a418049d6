// SPDX-License-Identifier: Apache-2.0
// Where a ray meets the volume's box, and its way through the macrocells (Amanatides and Woo 1987).
// Every step moves one index by one, so no input, NaN included, can make a walk endless.
#pragma once
#include "renderer/kernel/math.h"
#include "renderer/kernel/views.h"

namespace scolopax::kernel {

struct Interval {
  float enter, exit;  ///< along the ray; empty when enter >= exit
};

/// The part of the ray with t >= 0 inside the box [-1/2, dims - 1/2]; faces belong to the box.
SCOLOPAX_HD inline Interval clipToBox(const Ray& ray, glm::ivec3 dims) {
  Interval inside{0.0f, kInfinity};
  for (int axis = 0; axis < 3; ++axis) {
    const float lo = -0.5f, hi = float(dims[axis]) - 0.5f;
    const float o = ray.origin[axis], d = ray.direction[axis];
    if (d == 0.0f) {
      if (!(o >= lo && o <= hi)) return {0.0f, 0.0f};
      continue;
    }
    const float a = (lo - o) / d, b = (hi - o) / d;
    const float near = minimum(a, b), far = maximum(a, b);
    if (!(near <= far)) return {0.0f, 0.0f};  // not finite: such a ray sees nothing
    inside.enter = maximum(inside.enter, near);
    inside.exit = minimum(inside.exit, far);
  }
  if (!(inside.exit < kInfinity)) return {0.0f, 0.0f};  // no direction at all
  return inside;
}

class CellWalk {
 public:
  SCOLOPAX_HD CellWalk(const Ray& ray, Interval inside, const MajorantView& grid)
      : ray_(ray), grid_(grid), end_(inside.exit), enter_(inside.enter) {
    const float inverseSize = 1.0f / grid.cellSize;
    for (int axis = 0; axis < 3; ++axis) {
      const float at = (ray.origin[axis] + inside.enter * ray.direction[axis]) * inverseSize;
      cell_[axis] = int(clamp(at, 0.0f, float(grid.cells[axis] - 1)));
      // Finite also for a denormal direction: a plane at distance 0 is at t = 0, not NaN.
      inverseDirection_[axis] = clamp(1.0f / ray.direction[axis], -kLargestFinite, kLargestFinite);
      next_[axis] = planeAfter(axis);
    }
    leave();
  }

  /// Segment of the ray in the current cell; exit >= enter.
  SCOLOPAX_HD float enter() const { return enter_; }
  SCOLOPAX_HD float exit() const { return exit_; }

  /// Offset of the current cell's entry, in cells.
  SCOLOPAX_HD std::size_t index() const {
    return (std::size_t(cell_.z) * std::size_t(grid_.cells.y) + std::size_t(cell_.y)) *
               std::size_t(grid_.cells.x) +
           std::size_t(cell_.x);
  }

  /// Moves to the next cell; false at the end of the ray.
  SCOLOPAX_HD bool advance() {
    if (!(exit_ < end_)) return false;
    // A loop over constant indices: what a variable indexes cannot stay in a GPU's registers.
    for (int axis = 0; axis < 3; ++axis) {
      if (axis != axis_) continue;
      cell_[axis] += ray_.direction[axis] > 0.0f ? 1 : -1;
      next_[axis] = planeAfter(axis);
    }
    enter_ = exit_;
    leave();
    return true;
  }

  /// The point at t, moved into the current cell where rounding has put it outside: the cell's bound holds
  /// there.
  SCOLOPAX_HD glm::vec3 pointAt(float t) const {
    glm::vec3 p;
    for (int axis = 0; axis < 3; ++axis) {
      const float lo = float(cell_[axis]) * grid_.cellSize;
      const float hi = float(cell_[axis] + 1) * grid_.cellSize;
      const bool first = cell_[axis] == 0, last = cell_[axis] == grid_.cells[axis] - 1;
      const float x = ray_.origin[axis] + t * ray_.direction[axis];
      p[axis] = clamp(x, first ? -0.5f : lo, last ? hi + 0.5f : hi);
    }
    return p;
  }

 private:
  /// Where the ray leaves the current cell through `axis`; infinity where the box ends or it never does.
  SCOLOPAX_HD float planeAfter(int axis) const {
    const bool up = ray_.direction[axis] > 0.0f;
    if (ray_.direction[axis] == 0.0f || cell_[axis] == (up ? grid_.cells[axis] - 1 : 0)) return kInfinity;
    const float plane = float(cell_[axis] + (up ? 1 : 0)) * grid_.cellSize;
    return (plane - ray_.origin[axis]) * inverseDirection_[axis];
  }
  SCOLOPAX_HD void leave() {
    axis_ = next_.x <= next_.y ? (next_.x <= next_.z ? 0 : 2) : (next_.y <= next_.z ? 1 : 2);
    exit_ = maximum(enter_, minimum(axis_ == 0 ? next_.x : axis_ == 1 ? next_.y : next_.z, end_));
  }

  Ray ray_;
  MajorantView grid_;
  float end_, enter_, exit_ = 0.0f;
  int axis_ = 0;
  glm::ivec3 cell_;
  glm::vec3 inverseDirection_, next_;
};

}  // namespace scolopax::kernel
