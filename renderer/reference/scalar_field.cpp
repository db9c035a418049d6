// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/scalar_field.h"

#include <cmath>
#include <glm/common.hpp>
#include <limits>

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

double ScalarField::operator()(const glm::dvec3& point) const {
  const glm::dvec3 p = glm::clamp(point, glm::dvec3(0), glm::dvec3(dims_ - 1));
  const glm::dvec3 cell = glm::min(glm::floor(p), glm::max(glm::dvec3(dims_) - 2.0, 0.0));
  const auto c = corners(glm::ivec3(cell));
  if (!c) return std::numeric_limits<double>::quiet_NaN();
  // Axis by axis, so that equal corners give their value to the last bit, and rounding gives no gradient.
  std::array<double, 8> v = *c;
  for (std::size_t axis = 0, count = 4; axis < 3; ++axis, count /= 2) {
    const double w = p[int(axis)] - cell[int(axis)];
    for (std::size_t i = 0; i < count; ++i)
      v[i] = w == 1 ? v[2 * i + 1] : v[2 * i] + w * (v[2 * i + 1] - v[2 * i]);
  }
  return v[0];
}

glm::dvec3 ScalarField::gradient(const glm::dvec3& point) const {
  glm::dvec3 perVoxel(0);
  for (int axis = 0; axis < 3; ++axis) {
    const double last = dims_[axis] - 1, at = std::fmin(std::fmax(point[axis], 0), last);
    glm::dvec3 before = point, after = point;
    before[axis] = std::fmax(at - 1, 0);
    after[axis] = std::fmin(at + 1, last);
    if (!(before[axis] < after[axis])) continue;  // a single layer
    perVoxel[axis] = ((*this)(after) - (*this)(before)) / (after[axis] - before[axis]);
    if (!std::isfinite(perVoxel[axis])) return glm::dvec3(0);
  }
  return perVoxel;
}

}  // namespace scolopax::reference
