// SPDX-License-Identifier: Apache-2.0
// Where a ray is sampled: at equal steps, or by the differential sampling of Knoll et al. 2009.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::peaks {

/// Samples lie at distances T(x) = near + a x^2 / 2 + b x from the eye, for whole numbers x >= 0. Their
/// distance from each other, dT/dx = a x + b = sqrt(b^2 + 2 a (T - near)), grows along the ray if a > 0.
struct StepLaw {
  double near, a, b;  ///< world units

  double at(std::int64_t x) const { return near + double(x) * (0.5 * a * double(x) + b); }
  /// Eq. 18, solved without a division by a, which is 0 for equal steps and parallel rays.
  double indexAt(double distance) const {
    const double way = distance - near;
    return way > 0 ? 2 * way / (b + std::sqrt(b * b + 2 * a * way)) : 0;
  }
};

/// Equal steps, counted from the eye.
inline StepLaw uniformLaw(double step) { return {0, 0, step}; }

/// Width of a pixel at a distance from the eye, world units.
inline double footprint(const Camera& camera, int height, double distance) {
  constexpr double kRadians = 3.14159265358979323846 / 180;
  if (camera.orthoHeight) return *camera.orthoHeight / height;
  return distance * 2 * std::tan(0.5 * camera.fovY * kRadians) / height;
}

/// The available text of the paper lacks its equations for a and b (6 to 17), so these are our own: the step
/// is s_k footprints where the volume's box is nearest to the eye, and where it is farthest. The paper's s_k
/// is 4, for pictures some 1000 pixels high.
inline StepLaw differentialLaw(double sk, const Camera& camera, int height, const Grid& grid) {
  if (camera.orthoHeight) return {0, 0, sk * footprint(camera, height, 0)};
  const glm::dvec3 eye(glm::inverse(grid.worldFromVoxel) * glm::dvec4(camera.eye, 1));
  const glm::dvec3 low(-0.5), high = glm::dvec3(grid.dims) - 0.5;
  const auto distanceTo = [&](const glm::dvec3& voxel) {
    return glm::length(glm::dmat3(grid.worldFromVoxel) * (voxel - eye));
  };
  const double near = distanceTo(glm::clamp(eye, low, high));
  double far = near;
  for (int corner = 0; corner < 8; ++corner)
    far =
        std::max(far, distanceTo(glm::mix(low, high, glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2))));
  const double first = sk * footprint(camera, height, near), last = sk * footprint(camera, height, far);
  return {near, (last * last - first * first) / (2 * (far - near)), first};
}

}  // namespace scolopax::peaks
