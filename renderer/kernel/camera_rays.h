// SPDX-License-Identifier: Apache-2.0
// Rays through pixels, in voxel space. Filled by data/camera.cpp in double precision.
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "renderer/kernel/math.h"
#include "renderer/kernel/portable.h"

namespace scolopax::kernel {

/// origin + t * direction in voxel coordinates, t >= 0 in WORLD units of length.
template <class L>
struct RayOf {
  typename L::Vec origin, direction;
};
using Ray = RayOf<One>;

/// With film coordinates s = (x - width/2, height/2 - y) * pixelSize, in units of the view's height, a ray
/// has the origin origin0 + s.x * originX + s.y * originY. Its direction has the same form and is then
/// divided by sqrt(1 + perspective * |s|^2), its length in world units.
struct CameraRays {
  glm::vec3 origin0, originX, originY;
  glm::vec3 direction0, directionX, directionY;
  float pixelSize;     ///< 1 / height
  float perspective;   ///< (2 tan(fovY/2))^2, or 0 for an orthographic camera
  glm::vec2 halfSize;  ///< width/2, height/2 in pixels
  float start;  ///< distance from the eye to the plane in which rays start, along the view direction, world
                ///< units

  /// Ray through the point (x, y) of the image plane, in pixels from the top left corner.
  SCOLOPAX_HD Ray operator()(float x, float y) const { return through<One>(x, y); }
  template <class L>
  SCOLOPAX_LANES RayOf<L> through(typename L::Float x, typename L::Float y) const {
    using Vec = typename L::Vec;
    const auto sx = (x - halfSize.x) * pixelSize;
    const auto sy = (halfSize.y - y) * pixelSize;
    const auto inverseLength = 1.0f / squareRoot(1.0f + perspective * (sx * sx + sy * sy));
    return {Vec(origin0) + sx * Vec(originX) + sy * Vec(originY),
            (Vec(direction0) + sx * Vec(directionX) + sy * Vec(directionY)) * inverseLength};
  }
  /// Depth of the point t along the ray through (x, y): its distance from the eye along the view direction.
  template <class Float>
  SCOLOPAX_LANES Float depth(Float x, Float y, Float t) const {
    const Float sx = (x - halfSize.x) * pixelSize;
    const Float sy = (halfSize.y - y) * pixelSize;
    return start + t / squareRoot(1.0f + perspective * (sx * sx + sy * sy));
  }
};

}  // namespace scolopax::kernel
