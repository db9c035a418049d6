// SPDX-License-Identifier: Apache-2.0
// Which cells of a grid a ray passes, and from where to where.
#pragma once
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

namespace scolopax::reference {

/// origin + t * direction in voxel coordinates, as far as it lies in the box [-0.5, dims-0.5]; cuts[0] <= ...
/// are the t of entry, of every plane through voxel centres, and of exit. No cuts: the ray misses.
struct RayCells {
  glm::dvec3 origin, direction;
  std::vector<double> cuts;
};

/// Only 0 <= t <= `length` of the given ray counts; t of the result is counted from another origin on the
/// same line, near the volume. A ray along a face of the box counts as inside.
RayCells cutAtCells(const glm::dvec3& origin, const glm::dvec3& direction, const glm::ivec3& dims,
                    double length = std::numeric_limits<double>::infinity());

}  // namespace scolopax::reference
