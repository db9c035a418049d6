// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/gradient_along.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>

#include "renderer/reference/cell_scalar.h"

namespace scolopax::reference {
namespace {

/// A line and the cell that holds it.
struct LineInCell {
  glm::ivec3 cell;
  glm::dvec3 begin, end;  // in the cell's coordinates; in the outer half voxels, clamped to the outer centres
  LineInCell(const ScalarField& field, const glm::dvec3& from, const glm::dvec3& to)
      : cell(field.cellAt(0.5 * (from + to))), begin(inside(from)), end(inside(to)) {}
  glm::dvec3 inside(const glm::dvec3& point) const {
    return glm::clamp(point - glm::dvec3(cell), glm::dvec3(0), glm::dvec3(1));
  }
};

/// The trilinear scalar from `begin` to `end`, inside the outer voxel centres; none if a voxel is not finite.
std::optional<Bernstein> trilinearAlong(const ScalarField& field, const glm::dvec3& begin,
                                        const glm::dvec3& end) {
  const LineInCell line(field, begin, end);
  const auto corners = field.corners(line.cell);
  if (!corners) return std::nullopt;
  return Bernstein(CellScalar(*corners, line.begin, line.end).coefficients());
}

/// The vector (x, y, z), transformed.
BernsteinVector product(const glm::dmat3& m, const BernsteinVector& v) {
  const auto component = [&](int i) { return v.x * m[0][i] + v.y * m[1][i] + v.z * m[2][i]; };
  return {component(0), component(1), component(2)};
}

/// Of cubic interpolation.
std::optional<GradientAlong> derivativesAlong(const ScalarField& field, const glm::dvec3& begin,
                                              const glm::dvec3& end, const glm::dmat3& worldFromGradient) {
  const LineInCell line(field, begin, end);
  const auto spline = field.spline(line.cell);
  if (!spline) return std::nullopt;
  return GradientAlong{product(worldFromGradient, spline->gradientAlong(line.begin, line.end)),
                       Bernstein(std::array{1.0})};
}

/// By central differences of trilinear interpolation.
std::optional<GradientAlong> differencesAlong(const ScalarField& field, const glm::dvec3& begin,
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
    const auto after = trilinearAlong(field, stepped(begin, 1), stepped(end, 1));
    const auto before = trilinearAlong(field, stepped(begin, -1), stepped(end, -1));
    if (!after || !before) return std::nullopt;
    change[a] = *after - *before;
    const double first = stepped(begin, 1)[axis] - stepped(begin, -1)[axis];
    const double second = stepped(end, 1)[axis] - stepped(end, -1)[axis];
    if (std::abs(first - second) < 1e-12)  // equal within rounding
      change[a] = change[a] * (1 / first);
    else
      distance[a] = Bernstein(std::array{first, second});
  }
  const BernsteinVector scaled{change[0] * distance[1] * distance[2], change[1] * distance[2] * distance[0],
                               change[2] * distance[0] * distance[1]};
  return GradientAlong{product(worldFromGradient, scaled), distance[0] * distance[1] * distance[2]};
}

}  // namespace

std::optional<GradientAlong> gradientAlong(const ScalarField& field, const glm::dvec3& begin,
                                           const glm::dvec3& end, const glm::dmat3& worldFromGradient) {
  return field.interpolation() == Interpolation::cubic
             ? derivativesAlong(field, begin, end, worldFromGradient)
             : differencesAlong(field, begin, end, worldFromGradient);
}

}  // namespace scolopax::reference
