// SPDX-License-Identifier: Apache-2.0
// The cells of a grid that a ray passes through, and where it enters and leaves each.
#pragma once
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

namespace scolopax::reference {

/// The part of origin + t * direction, in voxel coordinates, that lies in the box [-0.5, dims-0.5]. cuts[0]
/// <= ... are the t of entry, of every plane through voxel centres, and of exit; none if the ray misses.
struct RayCells {
  glm::dvec3 origin, direction;
  std::vector<double> cuts;
};

/// Considers only 0 <= t <= `length` of the given ray. The t of the result is measured from another origin on
/// the same line, near the volume. A ray along a face of the box counts as inside.
RayCells cutAtCells(const glm::dvec3& origin, const glm::dvec3& direction, const glm::ivec3& dims,
                    double length = std::numeric_limits<double>::infinity());

}  // namespace scolopax::reference
