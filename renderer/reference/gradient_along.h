// SPDX-License-Identifier: Apache-2.0
// The gradient along a straight line inside one cell, as a polynomial: from it the integrator finds where a
// ray's light bends or jumps. What the gradient at a point is, says ScalarField::gradient.
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
  /// The values lie in the convex hull of these; of all components to the same degree.
  std::vector<glm::dvec3> controlPoints() const;
  /// No value is longer.
  double longest() const;
};

/// The gradient is `scaled` / `scale`: a cubic over 1, but in the outermost cells, where central differences
/// become one-sided, over a product of distances that change with u.
struct GradientAlong {
  BernsteinVector scaled;  ///< degree <= 5
  Bernstein scale;         ///< > 0; degree <= 3
};

/// From `begin` to `end`, voxel coordinates, both in one cell or in one outer half voxel, u from 0 to 1.
/// `worldFromGradient` takes changes per voxel step to where the result is wanted. None where the gradient is
/// zero because a voxel is not finite.
std::optional<GradientAlong> gradientAlong(const ScalarField& field, const glm::dvec3& begin,
                                           const glm::dvec3& end, const glm::dmat3& worldFromGradient);

}  // namespace scolopax::reference
