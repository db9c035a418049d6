// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/scalar_field.h"

#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "renderer/reference/lerp.h"

namespace scolopax::reference {

double ScalarField::voxel(const glm::ivec3& at) const {
  const std::size_t index =
      std::size_t(at.x) +
      std::size_t(dims_.x) * (std::size_t(at.y) + std::size_t(dims_.y) * std::size_t(at.z));
  const double stored = visitScalarType(channel_->voxels.type(), [&](auto zero) {
    return double(channel_->voxels.as<decltype(zero)>()[index]);
  });
  return channel_->slope * stored + channel_->intercept;
}

glm::dvec3 ScalarField::clamped(const glm::dvec3& point) const {
  return glm::clamp(point, glm::dvec3(0), glm::dvec3(dims_ - 1));
}

glm::ivec3 ScalarField::cellAt(const glm::dvec3& point) const {
  return glm::ivec3(glm::min(glm::floor(clamped(point)), glm::max(glm::dvec3(dims_) - 2.0, 0.0)));
}

std::optional<std::array<double, 8>> ScalarField::corners(const glm::ivec3& cell) const {
  std::array<double, 8> values;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 offset(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const double value = voxel(glm::min(cell + offset, dims_ - 1));
    if (!std::isfinite(value)) return std::nullopt;
    values[std::size_t(corner)] = value;
  }
  return values;
}

std::optional<SplineCell> ScalarField::spline(const glm::ivec3& cell) const {
  std::array<double, 64> values;
  for (int i = 0; i < 64; ++i) {
    const glm::ivec3 offset(i % 4 - 1, i / 4 % 4 - 1, i / 16 - 1);
    const double value = voxel(glm::clamp(cell + offset, glm::ivec3(0), dims_ - 1));
    if (!std::isfinite(value)) return std::nullopt;
    values[std::size_t(i)] = value;
  }
  return SplineCell(values);
}

std::optional<double> ScalarField::nearestVoxel(const glm::dvec3& point) const {
  const double value = voxel(glm::ivec3(glm::floor(clamped(point) + 0.5)));
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

double ScalarField::trilinear(const glm::dvec3& point) const {
  const glm::ivec3 cell = cellAt(point);
  const glm::dvec3 w = clamped(point) - glm::dvec3(cell);
  const auto c = corners(cell);
  if (!c) return std::numeric_limits<double>::quiet_NaN();
  // Axis by axis, so that equal corners give their value to the last bit, and rounding gives no gradient.
  std::array<double, 8> v = *c;
  for (std::size_t axis = 0, count = 4; axis < 3; ++axis, count /= 2)
    for (std::size_t i = 0; i < count; ++i) v[i] = lerpExact(v[2 * i], v[2 * i + 1], w[int(axis)]);
  return v[0];
}

double ScalarField::operator()(const glm::dvec3& point) const {
  switch (interpolation_) {
    case Interpolation::trilinear:
      break;
    case Interpolation::cubic: {
      const glm::ivec3 cell = cellAt(point);
      const auto here = spline(cell);
      return here ? (*here)(clamped(point) - glm::dvec3(cell)) : std::numeric_limits<double>::quiet_NaN();
    }
    case Interpolation::nearest:
      return nearestVoxel(point).value_or(std::numeric_limits<double>::quiet_NaN());
  }
  return trilinear(point);
}

glm::dvec3 ScalarField::gradient(const glm::dvec3& point) const {
  if (interpolation_ == Interpolation::cubic) {
    const glm::ivec3 cell = cellAt(point);
    const auto here = spline(cell);
    return here ? here->gradient(clamped(point) - glm::dvec3(cell)) : glm::dvec3(0);
  }
  glm::dvec3 perVoxel(0);
  for (int axis = 0; axis < 3; ++axis) {
    const double last = dims_[axis] - 1, at = std::fmin(std::fmax(point[axis], 0), last);
    glm::dvec3 before = point, after = point;
    before[axis] = std::fmax(at - 1, 0);
    after[axis] = std::fmin(at + 1, last);
    if (!(before[axis] < after[axis])) continue;  // a single layer
    perVoxel[axis] = (trilinear(after) - trilinear(before)) / (after[axis] - before[axis]);
    if (!std::isfinite(perVoxel[axis])) return glm::dvec3(0);
  }
  return perVoxel;
}

}  // namespace scolopax::reference
