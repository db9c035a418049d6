// SPDX-License-Identifier: Apache-2.0
// Camera in world space, as the scene gives it, and the rays it makes in voxel space.
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
  glm::dvec3 up{0, 1, 0};  ///< within 1e-6 of the view's direction: z is taken, or y where z is near it
  double fovY = 35;        ///< degrees, used without orthoHeight; in (0, 180)
  std::optional<double> orthoHeight;  ///< full height of the view in world units: an orthographic camera
  bool operator==(const Camera&) const = default;
};

/// Rays in voxel coordinates, computed in double and shifted to just before the box, so that neither an
/// offset of the world nor a far eye costs precision. Throws Error(badInput) for a camera without direction,
/// or with a number that is not finite or out of range.
kernel::CameraRays makeCameraRays(const Camera& camera, const Grid& grid, int width, int height);

/// The default view, from a little above and to the side: all points of `seen`, in voxel coordinates, in the
/// frame, or the whole box where there are none.
Camera framingCamera(const Grid& grid, double fovY, double aspect, std::span<const glm::vec3> seen = {});

}  // namespace scolopax
