// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/clipping.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <string>

#include "renderer/core/error.h"

namespace scolopax::reference {
namespace {

constexpr double kOnPlane = 1e-9;  // voxels

}  // namespace

Clipping::Clipping(const Scene& scene, const Grid& grid) : dims_(grid.dims), crop_(scene.crop) {
  const glm::dmat3 worldFromVoxel(grid.worldFromVoxel);
  const glm::dvec3 zero(grid.worldFromVoxel[3]);
  for (const ClipPlane& plane : scene.clip) {
    const glm::dvec3 n = plane.normal;
    const double largest = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});  // squares may underflow
    const glm::dvec3 normal = n / largest * worldFromVoxel;
    const double length = glm::length(normal);
    if (!(length > 0) || !std::isfinite(length))
      throw Error(ErrorCode::badInput, "reference: a clip plane needs a finite normal that is not 0");
    planes_.push_back({normal / length, glm::dot(n / largest, zero - plane.point) / length, plane.channels});
  }
}

void Clipping::cut(RayCells& ray) const {
  if (ray.cuts.empty()) return;
  const double begin = ray.cuts.front(), end = ray.cuts.back();
  const auto cutAt = [&](double side, double slope) {
    const double t = -side / slope;  // NaN or infinite for a ray along the plane
    if (t > begin && t < end) ray.cuts.push_back(t);
  };
  for (const Plane& plane : planes_)
    cutAt(glm::dot(plane.normal, ray.origin) + plane.offset, glm::dot(plane.normal, ray.direction));
  if (crop_)
    for (int axis = 0; axis < 3; ++axis)
      for (const double at : {crop_->low[axis], crop_->high[axis]})
        cutAt(ray.origin[axis] - at, ray.direction[axis]);
  std::sort(ray.cuts.begin(), ray.cuts.end());
}

bool Clipping::keeps(int channel, const glm::dvec3& voxel) const {
  for (const Plane& plane : planes_) {
    const bool clips = !plane.channels || std::count(plane.channels->begin(), plane.channels->end(), channel);
    if (clips && glm::dot(plane.normal, voxel) + plane.offset < -kOnPlane) return false;
  }
  if (!crop_) return true;
  int region = 0;
  for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= 3) {
    // A plane at a face of the volume or beyond cuts nothing off.
    const double first = -0.5, last = dims_[axis] - 0.5, low = crop_->low[axis], high = crop_->high[axis];
    if (low <= first || (low < last && voxel[axis] >= low - kOnPlane)) region += stride;
    if (high <= first || (high < last && voxel[axis] >= high - kOnPlane)) region += stride;
  }
  return crop_->regions >> region & 1;
}

}  // namespace scolopax::reference
