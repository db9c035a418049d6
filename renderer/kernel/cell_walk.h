// SPDX-License-Identifier: Apache-2.0
// Traverses the macrocells along a ray (Amanatides and Woo 1987). Every step moves forward by at least one
// cell, so no input, not even NaN, makes a walk endless.
#pragma once
#include "renderer/kernel/clip.h"

namespace scolopax::kernel {

/// Maximum number of segments, or of cells, that quadrature visits along a ray. A ray with more stops there
/// and counts as truncated.
inline constexpr int kMaxSegments = 1 << 20;

/// Index, along an axis, of the macrocell in which rays are at t. `inverseSize`: 1 / MajorantView::cellSize.
template <class L>
SCOLOPAX_LANES_PART typename L::Int macrocellAt(const RayOf<L>& ray, typename L::Float t, int axis,
                                                typename L::Float inverseSize, const MajorantView& grid) {
  const typename L::Float at = (ray.origin[axis] + t * ray.direction[axis]) * inverseSize;
  return truncated(clamp(at, 0.0f, float(grid.cells[axis] - 1)));
}

/// Visits the cells along a ray one after another. Where blocks of cells are empty, one step covers many
/// cells, from the entry of the first to the exit of the last, and the last becomes the current cell. Cells
/// that are not empty are visited exactly as without such leaps, to the last bit.
class CellWalk {
 public:
  SCOLOPAX_HD CellWalk(const Ray& ray, Interval inside, const MajorantView& grid)
      : ray_(ray), grid_(grid), end_(inside.exit), enter_(inside.enter), inverseSize_(1.0f / grid.cellSize) {
    std::int64_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int last = grid.cells[axis] - 1;
      const int cell = macrocellAt<One>(ray, inside.enter, axis, inverseSize_, grid);
      const bool up = ray.direction[axis] > 0.0f;
      cell_[axis] = cell;
      last_[axis] = ray.direction[axis] == 0.0f ? cell : up ? last : 0;
      step_[axis] = up ? 1 : -1;
      stride_[axis] = up ? stride : -stride;
      index_ += cell * stride;
      stride *= grid.cells[axis];
      plane_[axis] = float(cell + (up ? 1 : 0)) * grid.cellSize;
      planeStep_[axis] = up ? grid.cellSize : -grid.cellSize;
      // Kept finite even for a denormal direction, so that a plane at distance 0 is at t = 0, not NaN.
      inverseDirection_[axis] = clamp(1.0f / ray.direction[axis], -kLargestFinite, kLargestFinite);
      next_[axis] = exitThrough(axis);
    }
    leave();
    leapIfEmpty();
  }

  /// Part of the ray in the current cell and in the cells leapt over on the way to it; exit >= enter.
  SCOLOPAX_HD float enter() const { return enter_; }
  SCOLOPAX_HD float exit() const { return exit_; }

  /// Index of the current cell, as in MajorantView.
  SCOLOPAX_HD std::size_t index() const { return std::size_t(index_); }

  /// Moves to the next cell; false at the end of the ray.
  SCOLOPAX_HD bool advance() {
    if (!(exit_ < end_)) return false;
    // A loop over constant indices: an array indexed by a variable cannot stay in a GPU's registers.
    for (int axis = 0; axis < 3; ++axis) {
      if (axis != axis_) continue;
      cell_[axis] += step_[axis];
      index_ += stride_[axis];
      plane_[axis] += planeStep_[axis];  // exact, as these are whole numbers
      next_[axis] = exitThrough(axis);
    }
    enter_ = exit_;
    leave();
    leapIfEmpty();
    return true;
  }

  /// The point at t, moved into the current cell if rounding has put it outside, because the cell's bound
  /// holds only there.
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
  /// t at which the ray crosses the k-th plane between cells ahead of it; 0 is the next.
  SCOLOPAX_HD float planeAt(int axis, int k) const {
    return (plane_[axis] + float(k) * planeStep_[axis] - ray_.origin[axis]) * inverseDirection_[axis];
  }
  /// t at which the ray leaves the current cell through `axis`; infinite if it never does or if the grid ends
  /// there.
  SCOLOPAX_HD float exitThrough(int axis) const {
    return cell_[axis] == last_[axis] ? kInfinity : planeAt(axis, 0);
  }
  SCOLOPAX_HD void leave() {
    axis_ = nearestOf(next_);
    exit_ = maximum(enter_, minimum(axis_ == 0 ? next_.x : axis_ == 1 ? next_.y : next_.z, end_));
  }
  /// A leap costs as much as several steps, so a leap over a single block does not pay.
  SCOLOPAX_HD void leapIfEmpty() {
    if (!grid_.totals) return;
    const int radius = grid_.emptyRadius(index());
    if (radius > 1) leap(radius);
  }
  SCOLOPAX_HD static int nearestOf(const glm::vec3& t) {
    return t.x <= t.y ? (t.x <= t.z ? 0 : 2) : (t.y <= t.z ? 1 : 2);
  }

  /// Advances to the last cell along the ray inside the empty cube of blocks around the current one. Crosses
  /// all planes that come before the cube's faces, in the order in which leave() would.
  SCOLOPAX_HD void leap(int radius) {
    glm::ivec3 most;  // steps to the face of the cube that the ray moves towards
    glm::vec3 side;
    for (int axis = 0; axis < 3; ++axis) {
      const int into = cell_[axis] & (kBlockEdge - 1);
      const int toSide = (step_[axis] > 0 ? kBlockEdge - 1 - into : into) + kBlockEdge * (radius - 1);
      const int toLast = (last_[axis] - cell_[axis]) * step_[axis];
      most[axis] = toSide < toLast ? toSide : toLast;
      side[axis] = toSide < toLast ? planeAt(axis, toSide) : kInfinity;
    }
    const int out = nearestOf(side);
    const float nearest = out == 0 ? side.x : out == 1 ? side.y : side.z;
    if (!(nearest < end_)) {  // only empty cells are left
      exit_ = maximum(enter_, end_);
      return;
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto crosses = [&](int k) {
        return axis < out ? planeAt(axis, k) <= nearest : planeAt(axis, k) < nearest;
      };
      int steps = most[axis];
      if (axis != out) {
        const float way = ray_.origin[axis] + nearest * ray_.direction[axis] - plane_[axis];
        steps = int(clamp(way * float(step_[axis]) * inverseSize_ + 1.0f, 0.0f, float(steps)));
        while (steps < most[axis] && crosses(steps)) ++steps;
        while (steps > 0 && !crosses(steps - 1)) --steps;
      }
      cell_[axis] += steps * step_[axis];
      index_ += steps * stride_[axis];
      plane_[axis] += float(steps) * planeStep_[axis];
      next_[axis] = exitThrough(axis);
    }
    leave();
  }

  Ray ray_;
  MajorantView grid_;
  float end_, enter_, inverseSize_, exit_ = 0.0f;
  int axis_ = 0;
  glm::ivec3 cell_, last_, step_;
  std::int64_t index_ = 0, stride_[3];
  glm::vec3 plane_, planeStep_, inverseDirection_, next_;
};

}  // namespace scolopax::kernel
