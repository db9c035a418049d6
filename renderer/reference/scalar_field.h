// SPDX-License-Identifier: Apache-2.0
// One channel's voxels as data values in double, the scalar that is interpolated between them, and its
// gradient.
#pragma once
#include <array>
#include <glm/vec3.hpp>
#include <optional>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/reference/spline_cell.h"

namespace scolopax::reference {

/// Points are in voxel coordinates, and are clamped to the outer voxel centres.
class ScalarField {
 public:
  /// Keeps a pointer to `channel`, whose grid has `dims` voxels.
  ScalarField(const Channel& channel, const glm::ivec3& dims,
              Interpolation interpolation = Interpolation::trilinear)
      : channel_(&channel), dims_(dims), interpolation_(interpolation) {}

  const glm::ivec3& dims() const { return dims_; }
  Interpolation interpolation() const { return interpolation_; }
  /// First voxel of the cell that holds a point. In the outer half voxels that is the outermost cell.
  glm::ivec3 cellAt(const glm::dvec3& point) const;

  /// The eight voxels at the corners of the cell that begins at voxel `cell`, x fastest (along an axis of one
  /// voxel, the same voxel twice); none if one of them is not finite.
  std::optional<std::array<double, 8>> corners(const glm::ivec3& cell) const;
  /// The cubic B-spline in that cell; beyond the border the outer voxels are repeated. None if one of its 64
  /// voxels is not finite.
  std::optional<SplineCell> spline(const glm::ivec3& cell) const;
  /// The nearest voxel, of two at the same distance along an axis the later; none if it is not finite.
  std::optional<double> nearestVoxel(const glm::dvec3& point) const;

  /// The interpolated scalar; NaN where the function above that belongs to the interpolation gives none.
  double operator()(const glm::dvec3& point) const;
  /// Change per voxel along each axis. Of cubic interpolation: its derivatives. Of the others: of trilinear
  /// interpolation, the difference of the values one voxel after and one before, both points clamped to the
  /// outer voxel centres, divided by their distance. All zero if a value is not finite.
  glm::dvec3 gradient(const glm::dvec3& point) const;

 private:
  double voxel(const glm::ivec3& at) const;
  double trilinear(const glm::dvec3& point) const;
  glm::dvec3 clamped(const glm::dvec3& point) const;
  const Channel* channel_;
  glm::ivec3 dims_;
  Interpolation interpolation_;
};

}  // namespace scolopax::reference
