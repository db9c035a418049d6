// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/camera.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/core/is_finite.h"
#include "renderer/core/short_text.h"

namespace scolopax {
namespace {

struct Basis {
  glm::dvec3 right, up, forward;  // orthonormal
};

/// Divides by the largest component first, so that lengths near 1e-200 or 1e200 stay in range.
glm::dvec3 normalizeSafely(const glm::dvec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0) || !std::isfinite(largest)) return glm::dvec3(0);
  return glm::normalize(v / largest);
}

/// Least angle between `up` and the view, in radians; below it, `up` gives no direction.
constexpr double kLeastAngle = 1e-6;

Basis basisOf(const Camera& camera) {
  const glm::dvec3 forward = normalizeSafely(camera.target - camera.eye);
  if (forward == glm::dvec3(0))
    throw Error(ErrorCode::badInput, "camera: eye and target must be different, finite points");
  glm::dvec3 right = glm::cross(forward, normalizeSafely(camera.up));
  // If `up` is zero or along the view, any direction across the view will do. A smaller cross product would
  // be mostly rounding error, and not at right angles to the view.
  if (!(glm::length(right) > kLeastAngle)) {
    const glm::dvec3 across = std::abs(forward.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
    right = glm::cross(forward, across);
  }
  right = glm::normalize(right);
  return {right, glm::cross(right, forward), forward};
}

void checkCamera(const Camera& camera) {
  if (!isFinite(camera.eye) || !isFinite(camera.target) || !isFinite(camera.up))
    throw Error(ErrorCode::badInput, "camera: eye, target and up must be finite");
  if (camera.orthoHeight ? !(*camera.orthoHeight > 0 && std::isfinite(*camera.orthoHeight))
                         : !(camera.fovY > 0 && camera.fovY < 180))
    throw Error(
        ErrorCode::badInput,
        camera.orthoHeight
            ? "camera.orthoHeight: expected a finite number above 0, found " + shortText(*camera.orthoHeight)
            : "camera.fovY: expected above 0 and below 180, found " + shortText(camera.fovY));
}

glm::dvec3 centreOf(const Grid& grid) {
  return glm::dvec3(grid.worldFromVoxel * glm::dvec4(glm::dvec3(grid.dims - 1) * 0.5, 1));
}

}  // namespace

kernel::CameraRays makeCameraRays(const Camera& camera, const Grid& grid, int width, int height) {
  checkCamera(camera);
  const Basis basis = basisOf(camera);
  const glm::dmat4 voxelFromWorld = glm::inverse(grid.worldFromVoxel);
  const glm::dmat3 linear(voxelFromWorld);
  const double radius = 0.5 * grid.diagonal();
  // All rays start on one plane across the view. If the eye is outside the box's bounding sphere, the plane
  // is moved forward to the sphere, so that numbers in the kernel are no larger than the volume.
  const double ahead = glm::dot(centreOf(grid) - camera.eye, basis.forward) - radius * 1.000001;
  const double start = std::max(ahead, 0.0);
  const glm::dvec3 startPoint(voxelFromWorld * glm::dvec4(camera.eye + start * basis.forward, 1));

  const bool orthographic = camera.orthoHeight.has_value();
  const double halfAngle = camera.fovY * 0.5 * 3.14159265358979323846 / 180.0;
  const double viewHeight = orthographic ? *camera.orthoHeight : 2.0 * std::tan(halfAngle);
  const glm::dvec3 right = linear * basis.right, up = linear * basis.up;
  const double spread = orthographic ? 1.0 : start;
  // Film coordinates are scaled to the view's height, so that they are near 1 for either kind of camera.
  kernel::CameraRays rays;
  rays.origin0 = glm::vec3(startPoint);
  rays.originX = glm::vec3(right * spread * viewHeight);
  rays.originY = glm::vec3(up * spread * viewHeight);
  rays.direction0 = glm::vec3(linear * basis.forward);
  rays.directionX = orthographic ? glm::vec3(0) : glm::vec3(right * viewHeight);
  rays.directionY = orthographic ? glm::vec3(0) : glm::vec3(up * viewHeight);
  rays.pixelSize = float(1.0 / height);
  rays.perspective = orthographic ? 0.0f : float(viewHeight * viewHeight);
  rays.halfSize = {0.5f * float(width), 0.5f * float(height)};
  rays.start = float(start);
  return rays;
}

Camera framingCamera(const Grid& grid, double fovY, double aspect, std::span<const glm::vec3> seen) {
  std::vector<glm::dvec3> points(seen.begin(), seen.end());
  for (int corner = 0; seen.empty() && corner < 8; ++corner)
    points.push_back(glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1) * glm::dvec3(grid.dims) - 0.5);
  glm::dvec3 low = points[0], high = points[0];
  for (const glm::dvec3& p : points) low = glm::min(low, p), high = glm::max(high, p);
  Camera camera;
  camera.fovY = fovY;
  camera.target = glm::dvec3(grid.worldFromVoxel * glm::dvec4(0.5 * (low + high), 1));
  camera.up = {0, 0, 1};
  // From the front left and a little above, in the axes of the world (RAS: front is +y).
  const glm::dvec3 direction = glm::normalize(glm::dvec3(-0.55, 0.8, 0.35));
  camera.eye = camera.target + direction;
  const Basis basis = basisOf(camera);
  const double tanY = std::tan(fovY * 0.5 * 3.14159265358979323846 / 180.0), tanX = tanY * aspect;
  // The nearest eye from which every point lies inside the frame, with a margin of 5 %.
  double distance = 0;
  for (const glm::dvec3& voxel : points) {
    const glm::dvec3 p = glm::dvec3(grid.worldFromVoxel * glm::dvec4(voxel, 1)) - camera.target;
    const double x = std::abs(glm::dot(p, basis.right)), y = std::abs(glm::dot(p, basis.up));
    distance = std::max(distance, std::max(x / tanX, y / tanY) - glm::dot(p, basis.forward));
  }
  camera.eye = camera.target + direction * (distance * 1.05);
  return camera;
}

}  // namespace scolopax
