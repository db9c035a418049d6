// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/gradient_cells.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <limits>

#include "renderer/data/measuring.h"
#include "renderer/data/value_levels.h"
#include "renderer/kernel/filters.h"

namespace scolopax {
namespace {

/// Voxels from `low` to `high`, both included.
struct Voxels {
  glm::ivec3 low, high;
};
template <class F>
void forEach(const Voxels& voxels, F&& f) {
  for (int z = voxels.low.z; z <= voxels.high.z; ++z)
    for (int y = voxels.low.y; y <= voxels.high.y; ++y)
      for (int x = voxels.low.x; x <= voxels.high.x; ++x) f(glm::ivec3(x, y, z));
}

/// Bounds the gradients of one channel.
template <class T>
class Steepness {
 public:
  Steepness(const StridedVoxels<T>& voxels, glm::ivec3 dims, const glm::dmat3& fromVoxel, bool spline)
      : voxels_(voxels), dims_(dims), fromVoxel_(fromVoxel), spline_(spline) {
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) entries_[column] += std::abs(fromVoxel[column][row]);
  }

  /// Largest |gradient| at samples between these voxel centres, and beyond them where they are the outer
  /// ones; 0 if no sample has a gradient.
  float most(const Voxels& between) const {
    const glm::ivec3 last = dims_ - 1;
    const Voxels around{glm::max(between.low - 1, 0), glm::min(between.high + 1, last)};
    const bool inner = !spline_ && around.low == between.low - 1 && around.high == between.high + 1;
    glm::dvec3 least(std::numeric_limits<double>::infinity()), largest = -least;
    double value = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const bool atBorder = around.low[axis] == between.low[axis] || around.high[axis] == between.high[axis];
      if (spline_ && atBorder) least[axis] = largest[axis] = 0;  // voxels are repeated beyond the border
      addSlopes(spline_ ? around : between, around, axis, &least[axis], &largest[axis], &value);
    }
    glm::dvec3 steepest(0);
    for (int axis = 0; axis < 3; ++axis) {
      if (least[axis] > largest[axis]) least[axis] = largest[axis] = 0;  // no slope: an axis of one voxel
      steepest[axis] = std::max(std::abs(least[axis]), std::abs(largest[axis]));
    }
    double length = 0;
    if (inner)
      forEach(between, [&](glm::ivec3 v) { length = std::max(length, lengthAt(v)); });
    else
      for (int corner = 0; corner < 8; ++corner)
        length = std::max(length, glm::length(fromVoxel_ * glm::dvec3((corner & 1 ? largest : least).x,
                                                                      (corner & 2 ? largest : least).y,
                                                                      (corner & 4 ? largest : least).z)));
    return roundedUp(length, steepest, value);
  }

 private:
  double at(glm::ivec3 v) const {
    return double(
        voxels_[(std::size_t(v.z) * std::size_t(dims_.y) + std::size_t(v.y)) * std::size_t(dims_.x) +
                std::size_t(v.x)]);
  }

  /// Extends [least, largest] by the slopes along an axis between finite neighbours, and `value` by the
  /// magnitudes of their values.
  void addSlopes(const Voxels& between, const Voxels& around, int axis, double* least, double* largest,
                 double* value) const {
    Voxels from = between;
    from.low[axis] = around.low[axis];
    from.high[axis] = around.high[axis] - 1;
    glm::ivec3 step(0);
    step[axis] = 1;
    forEach(from, [&](glm::ivec3 v) {
      const double a = at(v), b = at(v + step);
      if (!std::isfinite(a) || !std::isfinite(b)) return;
      *least = std::min(*least, b - a);
      *largest = std::max(*largest, b - a);
      *value = std::max({*value, std::abs(a), std::abs(b)});
    });
  }

  /// |gradient| at a voxel by central differences; 0 if it is not finite.
  double lengthAt(glm::ivec3 v) const {
    glm::dvec3 change;
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 step(0);
      step[axis] = 1;
      change[axis] = 0.5 * (at(v + step) - at(v - step));
    }
    const double length = glm::length(fromVoxel_ * change);
    return std::isfinite(length) ? length : 0.0;
  }

  /// Adds the largest possible rounding error: of the two samples of every difference (kernel::roundingOf),
  /// of their positions (times the slope), and of the transform to world space.
  float roundedUp(double length, const glm::dvec3& steepest, double value) const {
    if (steepest == glm::dvec3(0)) return 0.0f;
    const double rounding =
        2 * kernel::roundingOf(spline_ ? kernel::Filter::cubic : kernel::Filter::trilinear);
    double slack = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (dims_[axis] > 1)
        slack += entries_[axis] * (value * rounding + (steepest[0] + steepest[1] + steepest[2]) *
                                                          (double(dims_[axis]) * 0x1p-22 + 0x1p-20));
    const float most = float((length + slack) * (1 + 0x1p-20));
    constexpr float kLargest = std::numeric_limits<float>::max();
    return most < kLargest ? std::nextafter(most, kLargest) : kLargest;
  }

  const StridedVoxels<T>& voxels_;
  glm::ivec3 dims_;
  glm::dmat3 fromVoxel_;
  bool spline_;
  glm::dvec3 entries_{0};  // per column of the matrix: sum of magnitudes
};

}  // namespace

GradientCells buildGradientCells(const Volume& volume, int channel, int size, Interpolation interpolation,
                                 const std::stop_token& stop) {
  const Grid& grid = volume.grid();
  const glm::ivec3 cells = macrocellsOf(grid.dims, size), last = grid.dims - 1;
  std::vector<ValueInterval> steepness(countOf(cells));
  const VoxelView& view = volume.channels()[std::size_t(channel)].voxels;
  visitScalarType(view.type(), [&](auto zero) {
    const auto voxels = view.as<decltype(zero)>();
    const Steepness steep(voxels, grid.dims, grid.gradientFromVoxel(), interpolation == Interpolation::cubic);
    tbb::parallel_for(0, cells.z, [&](int z) {
      std::size_t cell = std::size_t(z) * std::size_t(cells.y) * std::size_t(cells.x);
      for (int y = 0; y < cells.y; ++y) {
        checkWanted(stop);
        for (int x = 0; x < cells.x; ++x) {
          const glm::ivec3 low = glm::ivec3(x, y, z) * size;
          const float most = steep.most({low, glm::min(low + size, last)});
          steepness[cell++] = {most, most};
        }
      }
    });
  });
  GradientCells result;
  result.levels.values = chooseLevels(steepness);
  result.cells.resize(steepness.size());
  forEachOf(steepness.size(), kManyCells, stop,
            [&](std::size_t cell) { result.cells[cell] = encode(result.levels, steepness[cell]).hi; });
  return result;
}

}  // namespace scolopax
