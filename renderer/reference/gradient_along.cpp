// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/gradient_along.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "renderer/reference/cell_scalar.h"

namespace scolopax::reference {
namespace {

/// The scalar from `begin` to `end`, inside the outer voxel centres; none if a voxel is not finite.
std::optional<Bernstein> scalarAlong(const ScalarField& field, const glm::dvec3& begin,
                                     const glm::dvec3& end) {
  const glm::dvec3 last = glm::max(glm::dvec3(field.dims()) - 2.0, 0.0);
  const glm::dvec3 cell = glm::min(glm::floor(0.5 * (begin + end)), last);
  const auto corners = field.corners(glm::ivec3(cell));
  if (!corners) return std::nullopt;
  const auto inside = [&](const glm::dvec3& p) { return glm::clamp(p - cell, glm::dvec3(0), glm::dvec3(1)); };
  return Bernstein(CellScalar(*corners, inside(begin), inside(end)).coefficients());
}

}  // namespace

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

std::optional<GradientAlong> gradientAlong(const ScalarField& field, const glm::dvec3& begin,
                                           const glm::dvec3& end, const glm::dmat3& worldFromGradient) {
  const glm::dvec3 last(field.dims() - 1);
  std::array<Bernstein, 3> change, distance;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t a = std::size_t(axis);
    distance[a] = Bernstein(std::array{1.0});
    if (field.dims()[axis] == 1) continue;  // no change along a single layer
    const auto stepped = [&](const glm::dvec3& point, double by) {
      glm::dvec3 p = glm::clamp(point, glm::dvec3(0), last);
      p[axis] = std::clamp(p[axis] + by, 0.0, last[axis]);
      return p;
    };
    const auto after = scalarAlong(field, stepped(begin, 1), stepped(end, 1));
    const auto before = scalarAlong(field, stepped(begin, -1), stepped(end, -1));
    if (!after || !before) return std::nullopt;
    change[a] = *after - *before;
    const double first = stepped(begin, 1)[axis] - stepped(begin, -1)[axis];
    const double second = stepped(end, 1)[axis] - stepped(end, -1)[axis];
    if (std::abs(first - second) < 1e-12)  // equal within rounding
      change[a] = change[a] * (1 / first);
    else
      distance[a] = Bernstein(std::array{first, second});
  }
  const Bernstein x = change[0] * distance[1] * distance[2], y = change[1] * distance[2] * distance[0],
                  z = change[2] * distance[0] * distance[1];
  const auto component = [&](int i) {
    return x * worldFromGradient[0][i] + y * worldFromGradient[1][i] + z * worldFromGradient[2][i];
  };
  return GradientAlong{{component(0), component(1), component(2)}, distance[0] * distance[1] * distance[2]};
}

}  // namespace scolopax::reference
