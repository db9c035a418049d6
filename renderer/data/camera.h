// SPDX-License-Identifier: Apache-2.0
// The camera in world space, as the scene gives it, and its rays in voxel space.
#pragma once
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "renderer/data/volume.h"
#include "renderer/kernel/camera_rays.h"

namespace scolopax {

/// Right-handed, world units. Looks from eye to target; pixel (0,0) is top left.
struct Camera {
  glm::dvec3 eye{0, 0, 1};
  glm::dvec3 target{0};
  glm::dvec3 up{0, 1, 0};  ///< if parallel to the view within 1e-6: z is used, or y for a view near z
  double fovY = 35;        ///< degrees, in (0, 180); unused with orthoHeight
  std::optional<double> orthoHeight;  ///< full height of an orthographic view, world units
  bool operator==(const Camera&) const = default;
};

/// Rays in voxel coordinates. They are computed in double and start just in front of the box, so that neither
/// a large world offset nor a distant eye costs precision. Throws Error(badInput) if eye and target coincide,
/// or if a number is not finite or out of range.
kernel::CameraRays makeCameraRays(const Camera& camera, const Grid& grid, int width, int height);

/// The default view, from slightly above and to the side. It frames all points of `seen`, in voxel
/// coordinates, or the whole box if there are none.
Camera framingCamera(const Grid& grid, double fovY, double aspect, std::span<const glm::vec3> seen = {});

}  // namespace scolopax
