// SPDX-License-Identifier: Apache-2.0
// The trilinear scalar along a straight line inside one cell of eight voxels: a cubic, and the points where
// it takes a given value.
#pragma once
#include <array>
#include <glm/vec3.hpp>
#include <vector>

namespace scolopax::reference {

/// Trilinear interpolation along the line from `begin` (u = 0) to `end` (u = 1), kept as Bernstein
/// coefficients: every value lies between the smallest and the largest of them.
class CellScalar {
 public:
  /// `corners` x fastest; points in the cell's own coordinates, [0,1]^3.
  CellScalar(const std::array<double, 8>& corners, const glm::dvec3& begin, const glm::dvec3& end);
  /// One value along the whole line.
  explicit CellScalar(double constant) { b_.fill(constant); }

  double operator()(double u) const;
  const std::array<double, 4>& coefficients() const { return b_; }
  /// Bounds over [0,1].
  double lower() const;
  double upper() const;
  /// Appends every u in (0,1) at which the scalar crosses `value`.
  void appendCrossings(double value, std::vector<double>& crossings) const;

 private:
  double derivative(double u) const;
  double crossingBetween(double begin, double end, double value) const;
  std::array<double, 4> b_;
};

}  // namespace scolopax::reference
