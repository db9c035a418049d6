// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/bernstein_vector.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace scolopax::reference {

std::vector<glm::dvec3> BernsteinVector::controlPoints() const {
  const Bernstein zero = (x + y + z) * 0.0;  // of the highest of their degrees
  const Bernstein a = x + zero, b = y + zero, c = z + zero;
  std::vector<glm::dvec3> points;
  for (std::size_t k = 0; k <= zero.degree(); ++k)
    points.emplace_back(a.coefficients()[k], b.coefficients()[k], c.coefficients()[k]);
  return points;
}

double BernsteinVector::longest() const {
  double most = 0;
  for (const glm::dvec3& p : controlPoints()) most = std::max(most, glm::length(p));
  return most;
}

}  // namespace scolopax::reference
