// SPDX-License-Identifier: Apache-2.0
// Clip planes and crop, in double: where rays are cut, and which channels remain at a point.
#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/reference/ray_cells.h"

namespace scolopax::reference {

class Clipping {
 public:
  /// Throws Error(badInput) for a normal that is 0 or not finite.
  Clipping(const Scene& scene, const Grid& grid);
  /// Adds to the ray's cuts the points at which it crosses a plane.
  void cut(RayCells& ray) const;
  /// Whether a channel of the volume remains at a point in voxel coordinates. Points on a plane, to within
  /// rounding, count as on its kept side, and as in the upper of two crop regions.
  bool keeps(int channel, const glm::dvec3& voxel) const;

 private:
  /// Keeps dot(normal, voxel) + offset >= 0; the normal has length 1 in voxels.
  struct Plane {
    glm::dvec3 normal;
    double offset;
    std::optional<std::vector<int>> channels;
  };
  glm::ivec3 dims_;
  std::vector<Plane> planes_;
  std::optional<Crop> crop_;
};

}  // namespace scolopax::reference
