// SPDX-License-Identifier: Apache-2.0
// Vectors that are polynomials, component by component.
#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "renderer/reference/bernstein.h"

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

}  // namespace scolopax::reference
