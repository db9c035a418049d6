// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/ray_cells.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace scolopax::reference {
namespace {

// In voxels: how far rounding may carry a ray off the face it was meant to run along, and how much it may
// drift across the box and still count as parallel to an axis.
constexpr double kFaceTolerance = 1e-9;
constexpr double kDriftTolerance = 1e-12;

}  // namespace

RayCells cutAtCells(const glm::dvec3& origin, const glm::dvec3& direction, const glm::ivec3& dims,
                    double length, CutAt planes) {
  const glm::dvec3 size(dims), centre = 0.5 * (size - 1.0);
  // Starts from the point nearest to the centre, so that a distant eye costs no precision in the differences
  // below.
  const double nearest = glm::dot(centre - origin, direction) / glm::dot(direction, direction);
  RayCells ray{origin + nearest * direction, direction, {}};
  double begin = -nearest, end = length - nearest;

  const double crossing = glm::length(size) / glm::length(direction);  // longest range of t inside the box
  for (int axis = 0; axis < 3; ++axis) {
    double& o = ray.origin[axis];
    double& d = ray.direction[axis];
    const double low = -0.5, high = size[axis] - 0.5;
    if (std::abs(d) * crossing < kDriftTolerance) {
      if (o < low - kFaceTolerance || o > high + kFaceTolerance) return ray;
      d = 0;
      o = std::clamp(o, low, high);
    } else {
      const double a = (low - o) / d, b = (high - o) / d;
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
  }
  if (!(begin < end)) return ray;

  ray.cuts = {begin, end};
  const auto cutAt = [&](int axis, double plane) {
    const double t = (plane - ray.origin[axis]) / ray.direction[axis];
    if (t > begin && t < end) ray.cuts.push_back(t);
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0) continue;
    for (int k = 0; k < dims[axis]; ++k) cutAt(axis, k);
    if (planes == CutAt::voxelCentresAndFaces)
      for (int k = 1; k < dims[axis]; ++k) cutAt(axis, k - 0.5);
  }
  std::sort(ray.cuts.begin(), ray.cuts.end());
  return ray;
}

CellOnRay::CellOnRay(const RayCells& ray, double from, double to, const glm::ivec3& dims) {
  middle = ray.origin + 0.5 * (from + to) * ray.direction;
  cell = glm::clamp(glm::floor(middle), glm::dvec3(0), glm::max(glm::dvec3(dims) - 2.0, 0.0));
  // In the outer half voxels coordinates are exactly 0 or 1, also at the cuts. So what is equal is equal to
  // the last bit, and max can tell which of two channels comes first.
  const glm::dvec3 between = middle - cell;
  const auto inCell = [&](double t) {
    glm::dvec3 p = glm::clamp(ray.origin + t * ray.direction - cell, glm::dvec3(0), glm::dvec3(1));
    for (int axis = 0; axis < 3; ++axis)
      if (between[axis] <= 0 || between[axis] >= 1) p[axis] = between[axis] <= 0 ? 0 : 1;
    return p;
  };
  begin = inCell(from);
  end = inCell(to);
}

}  // namespace scolopax::reference
