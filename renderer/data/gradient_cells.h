// SPDX-License-Identifier: Apache-2.0
// Per macrocell: an upper bound of |gradient| over all samples in the cell. Built from a Volume once, for
// channels whose opacity depends on the gradient; bound_columns reads it.
#pragma once
#include <stop_token>
#include <vector>

#include "renderer/data/macrocell_grid.h"
#include "renderer/data/method.h"

namespace scolopax {

struct GradientCells {
  ValueLevels levels;               ///< of |gradient|: stored values per smallest spacing
  std::vector<std::uint8_t> cells;  ///< per macrocell: the level that no |gradient| exceeds
  std::size_t sizeBytes() const { return cells.size(); }
};

/// Measures one channel in macrocells with edges of `size` voxels. The bounds hold for what the kernels
/// compute in float (kernel/gradient.h), rounding included.
///
/// Where no difference is one-sided, the gradient of the trilinear interpolant by central differences is the
/// trilinear interpolation of the voxels' gradients, so it is no longer than the longest of them. At the
/// border every difference is a mean of slopes between neighbouring voxels along its axis, so these slopes
/// bound each component. So is every component of the gradient of a cubic B-spline.
/// Throws Error(cancelled) once `stop` is requested.
GradientCells buildGradientCells(const Volume& volume, int channel, int size, Interpolation interpolation,
                                 const std::stop_token& stop = {});

}  // namespace scolopax
