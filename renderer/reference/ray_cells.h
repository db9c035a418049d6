// SPDX-License-Identifier: Apache-2.0
// The cells of a grid that a ray passes through, and where it enters and leaves each.
#pragma once
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

namespace scolopax::reference {

/// The part of origin + t * direction, in voxel coordinates, that lies in the box [-0.5, dims-0.5]. cuts[0]
/// <= ... are the t of entry, of every plane through voxel centres (or more planes), and of exit; none if the
/// ray misses.
struct RayCells {
  glm::dvec3 origin, direction;
  std::vector<double> cuts;
};

/// At which planes a ray is cut.
enum class CutAt { voxelCentres, voxelCentresAndFaces };

/// Considers only 0 <= t <= `length` of the given ray. The t of the result is measured from another origin on
/// the same line, near the volume. A ray along a face of the box counts as inside.
RayCells cutAtCells(const glm::dvec3& origin, const glm::dvec3& direction, const glm::ivec3& dims,
                    double length = std::numeric_limits<double>::infinity(),
                    CutAt planes = CutAt::voxelCentres);

/// The part of a ray between two neighbouring cuts, and the cell of eight voxels in which it lies. In the
/// outer half voxels, where values are clamped to the edge, that is the outermost cell.
struct CellOnRay {
  CellOnRay(const RayCells& ray, double begin, double end, const glm::ivec3& dims);
  glm::dvec3 middle;      ///< voxel coordinates
  glm::dvec3 cell;        ///< its first voxel
  glm::dvec3 begin, end;  ///< in the cell's coordinates, [0,1]^3
};

}  // namespace scolopax::reference
