// SPDX-License-Identifier: Apache-2.0
// A channel at points: every interpolation as a sum of voxels times weights, written down as its definition
// says. Shares no code with the renderer.
#pragma once
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::reference {

class PointField {
 public:
  PointField(const Channel& channel, const glm::ivec3& dims, Interpolation interpolation)
      : dims_(dims), interpolation_(interpolation), values_(channel.voxels.count()) {
    visitScalarType(channel.voxels.type(), [&](auto zero) {
      const auto voxels = channel.voxels.as<decltype(zero)>();
      for (std::size_t i = 0; i < values_.size(); ++i)
        values_[i] = channel.slope * double(voxels[i]) + channel.intercept;
    });
  }

  /// At voxel coordinates; not finite where there is no value.
  double scalar(const glm::dvec3& point) const {
    switch (interpolation_) {
      case Interpolation::trilinear:
        return trilinear(point);
      case Interpolation::cubic:
        return spline(point, -1);
      case Interpolation::nearest:
        return value(glm::ivec3(glm::floor(inside(point) + 0.5)));
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  /// Change per voxel; none if it is not finite.
  std::optional<glm::dvec3> gradient(const glm::dvec3& point) const {
    glm::dvec3 change(0);
    const glm::dvec3 last(dims_ - 1), p = inside(point);
    for (int axis = 0; axis < 3; ++axis) {
      if (dims_[axis] == 1) continue;
      glm::dvec3 before = p, after = p;
      before[axis] = std::fmax(p[axis] - 1, 0.0);
      after[axis] = std::fmin(p[axis] + 1, last[axis]);
      change[axis] = interpolation_ == Interpolation::cubic
                         ? spline(p, axis)
                         : (trilinear(after) - trilinear(before)) / (after[axis] - before[axis]);
      if (!std::isfinite(change[axis])) return std::nullopt;
    }
    return change;
  }

 private:
  glm::dvec3 inside(const glm::dvec3& p) const { return glm::clamp(p, glm::dvec3(0), glm::dvec3(dims_ - 1)); }
  /// The first voxel of the cell; the border belongs to the outermost cell.
  glm::dvec3 cellAt(const glm::dvec3& p) const {
    return glm::max(glm::min(glm::floor(inside(p)), glm::dvec3(dims_) - 2.0), 0.0);
  }
  double value(const glm::ivec3& at) const {
    const glm::ivec3 v = glm::clamp(at, glm::ivec3(0), dims_ - 1);
    return values_[std::size_t(v.x + dims_.x * (v.y + dims_.y * v.z))];
  }
  double trilinear(const glm::dvec3& point) const {
    const glm::dvec3 cell = cellAt(point), t = inside(point) - cell;
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 bit(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) weight *= bit[axis] ? t[axis] : 1 - t[axis];
      sum += weight * value(glm::ivec3(cell) + bit);  // a corner that is not finite counts with weight 0 too
    }
    return sum;
  }
  /// The cubic B-spline, or its derivative along an axis.
  double spline(const glm::dvec3& point, int derivative) const {
    const glm::dvec3 cell = cellAt(point), at = inside(point) - cell;
    std::array<std::array<double, 4>, 3> weight;
    for (int axis = 0; axis < 3; ++axis) {
      const double t = at[axis];
      weight[std::size_t(axis)] =
          axis == derivative
              ? std::array{-(1 - t) * (1 - t) / 2, (3 * t * t - 4 * t) / 2, (-3 * t * t + 2 * t + 1) / 2,
                           t * t / 2}
              : std::array{(1 - t) * (1 - t) * (1 - t) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                           (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
    }
    double sum = 0;
    for (std::size_t z = 0; z < 4; ++z)
      for (std::size_t y = 0; y < 4; ++y)
        for (std::size_t x = 0; x < 4; ++x)
          sum += weight[0][x] * weight[1][y] * weight[2][z] *
                 value(glm::ivec3(cell) + glm::ivec3(int(x) - 1, int(y) - 1, int(z) - 1));
    return sum;
  }

  glm::ivec3 dims_;
  Interpolation interpolation_;
  std::vector<double> values_;
};

}  // namespace scolopax::reference
