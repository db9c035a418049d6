// SPDX-License-Identifier: Apache-2.0
// The uniform cubic B-spline inside one cell, whose coefficients are the voxels (Unser 1999, Splines: a
// perfect fit for signal and image processing): at points, and along straight lines as polynomials.
#pragma once
#include <array>
#include <glm/vec3.hpp>

#include "renderer/reference/bernstein_vector.h"

namespace scolopax::reference {

/// Points are in the cell's coordinates, [0,1]^3.
class SplineCell {
 public:
  /// Along every axis the voxel before the cell, the two at its ends, and the one after it; x fastest.
  explicit SplineCell(const std::array<double, 64>& voxels) : voxels_(voxels) {}

  /// Between the smallest and the largest voxel, and exact where all are equal.
  double operator()(const glm::dvec3& point) const;
  /// Change per voxel along each axis.
  glm::dvec3 gradient(const glm::dvec3& point) const;
  /// From `begin` (u = 0) to `end` (u = 1), of degree 9. All coefficients lie between the smallest and the
  /// largest voxel.
  Bernstein along(const glm::dvec3& begin, const glm::dvec3& end) const;
  /// The same of the gradient, of degree 8.
  BernsteinVector gradientAlong(const glm::dvec3& begin, const glm::dvec3& end) const;

 private:
  std::array<double, 64> voxels_;
};

}  // namespace scolopax::reference
