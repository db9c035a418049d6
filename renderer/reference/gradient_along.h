// SPDX-License-Identifier: Apache-2.0
// The gradient along a straight line inside one cell, as a polynomial, from which the integrator finds where
// a ray's light bends or jumps. ScalarField::gradient defines the gradient at a point.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "renderer/reference/bernstein.h"
#include "renderer/reference/scalar_field.h"

namespace scolopax::reference {

/// Three polynomials of u in [0,1].
struct BernsteinVector {
  Bernstein x, y, z;
  Bernstein dot(const BernsteinVector& other) const { return x * other.x + y * other.y + z * other.z; }
  Bernstein dot(const glm::dvec3& v) const { return x * v.x + y * v.y + z * v.z; }
  BernsteinVector between(double begin, double end) const {
    return {x.between(begin, end), y.between(begin, end), z.between(begin, end)};
  }
  glm::dvec3 operator()(double u) const { return {x(u), y(u), z(u)}; }
  /// Bernstein coefficients, all components raised to the same degree. All values lie in their convex hull.
  std::vector<glm::dvec3> controlPoints() const;
  /// Upper bound of the length of any value.
  double longest() const;
};

/// The gradient is `scaled` / `scale`. Inside the volume, `scaled` is a cubic and `scale` is 1. In the
/// outermost cells, where central differences become one-sided, `scale` is a product of distances that change
/// with u.
struct GradientAlong {
  BernsteinVector scaled;  ///< degree <= 5
  Bernstein scale;         ///< > 0; degree <= 3
};

/// The gradient from `begin` (u = 0) to `end` (u = 1), in voxel coordinates, both in one cell or in one outer
/// half voxel. `worldFromGradient` converts changes per voxel step to the space and units of the result. None
/// if a voxel is not finite, where the gradient counts as zero.
std::optional<GradientAlong> gradientAlong(const ScalarField& field, const glm::dvec3& begin,
                                           const glm::dvec3& end, const glm::dmat3& worldFromGradient);

}  // namespace scolopax::reference
