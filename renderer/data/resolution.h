// SPDX-License-Identifier: Apache-2.0
// The ladder of resolutions at which quadrature renders a scene.
#pragma once
#include <limits>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// Transmittance below which matter behind is invisible, even in float pictures of high contrast.
inline constexpr double kOpaqueTransmittance = 1e-4;
/// Optical depth above which segments in whole voxel cells are shortened.
inline constexpr double kThickestSegment = 0.5;

/// How finely quadrature divides rays.
struct Resolution {
  double step;     ///< longest segment, in smallest spacings
  bool voxelwise;  ///< segments also end at the faces of voxel cells; otherwise all are of that length
  bool operator==(const Resolution&) const = default;
};

/// A step that is longer than any cell of a grid.
inline constexpr double kWholeCell = std::numeric_limits<double>::infinity();

/// Resolution number 0, 1, ... of the ladder: equal steps from 32 smallest spacings down to 1/2; voxel cell
/// by voxel cell; the same with segments of at most 1, 1/2, 1/4, ... spacings. Every one has less bias than
/// the one before it, and costs more.
Resolution resolutionAt(int index);
inline constexpr int kEqualSteps = 7;    ///< number of those with equal steps
inline constexpr int kResolutions = 15;  ///< the last has steps of 1/64, where float's precision begins to
                                         ///< limit a march

/// The smallest step, in smallest spacings, at which biases are estimated: the longest ray through the grid
/// has 2^16 of them. Only a limit on the work of estimates: pictures are rendered with smaller steps, too.
double finestEstimatedStep(const Grid& grid);

/// The scene's own.
Resolution resolutionOf(const Scene& scene);
/// As Scene::step: the longest segment, or 0 for whole voxel cells.
double sceneStep(const Resolution& resolution);
kernel::OpacityLimit opacityLimit(double transmittance);
/// Makes kernels render the view at a resolution. The view's spacing and filters must be set.
void setResolution(kernel::SceneView& view, const Resolution& resolution);

}  // namespace scolopax
