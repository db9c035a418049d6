// SPDX-License-Identifier: Apache-2.0
// One channel's voxels as data values in double, interpolated trilinearly, and their gradient.
#pragma once
#include <array>
#include <glm/vec3.hpp>
#include <optional>

#include "renderer/data/volume.h"

namespace scolopax::reference {

class ScalarField {
 public:
  /// Keeps a pointer to `channel`, whose grid has `dims` voxels.
  ScalarField(const Channel& channel, const glm::ivec3& dims) : channel_(&channel), dims_(dims) {}

  const glm::ivec3& dims() const { return dims_; }
  /// The eight voxels at the corners of the cell that begins at voxel `cell`, x fastest (along an axis of one
  /// voxel, the same voxel twice); none if one of them is not finite.
  std::optional<std::array<double, 8>> corners(const glm::ivec3& cell) const;
  /// Trilinear interpolation at voxel coordinates, clamped to the outer voxel centres; NaN where corners()
  /// gives none.
  double operator()(const glm::dvec3& point) const;
  /// Change per voxel along each axis: the difference of the values one voxel after and one before, both
  /// points clamped to the outer voxel centres, divided by their distance. All zero if one of the values is
  /// not finite.
  glm::dvec3 gradient(const glm::dvec3& point) const;

 private:
  double voxel(const glm::ivec3& at) const;
  const Channel* channel_;
  glm::ivec3 dims_;
};

}  // namespace scolopax::reference
