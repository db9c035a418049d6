// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/resolution.h"

#include <algorithm>
#include <cmath>

#include "renderer/kernel/lanes.h"

namespace scolopax {

Resolution resolutionAt(int index) {
  if (index < kEqualSteps) return {std::ldexp(32.0, -index), false};
  if (index == kEqualSteps) return {kWholeCell, true};
  return {std::ldexp(1.0, kEqualSteps + 1 - index), true};
}

double finestEstimatedStep(const Grid& grid) { return grid.diagonal() / grid.smallestSpacing() * 0x1p-16; }

Resolution resolutionOf(const Scene& scene) {
  return scene.step > 0 ? Resolution{scene.step, false} : Resolution{kWholeCell, true};
}

double sceneStep(const Resolution& resolution) {
  return std::isfinite(resolution.step) ? resolution.step : 0;
}

kernel::OpacityLimit opacityLimit(double transmittance) {
  return {float(transmittance), float(-std::log(transmittance))};
}

void setResolution(kernel::SceneView& view, const Resolution& resolution) {
  view.voxelwise = resolution.voxelwise;
  view.step =
      std::isfinite(resolution.step) ? view.smallestSpacing * float(resolution.step) : kernel::kInfinity;
  // The biases of ending rays early, and of what hides other matter in the same segment, must fall with that
  // of the segments' lengths, which is of second order.
  const double part = view.cutsAtVoxels() ? std::min(1.0, resolution.step / 2) : 1.0;
  view.thickest = float(kThickestSegment * part);
  view.opaque = opacityLimit(kOpaqueTransmittance * part * part);
}

}  // namespace scolopax
