// SPDX-License-Identifier: Apache-2.0
// Gradient shading and lights, in double: the radiance that matter at a point sends to the eye. Everything is
// in world space.
#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "renderer/data/scene.h"

namespace scolopax::reference {

/// A vector of the same direction and length 1; of length 0 if `v` is.
glm::dvec3 unit(const glm::dvec3& v);

/// One light as it arrives at a point.
struct ArrivingLight {
  glm::dvec3 direction;  ///< towards the light, length 1; 0 at the light itself
  double distance;       ///< up to which matter can shadow it
  glm::dvec3 intensity;  ///< linear RGB
  double visibility = 1;
};

class Lighting {
 public:
  /// `zero` is the origin of coordinates. Throws Error(badInput) for lights and materials with values that
  /// are not finite, negative, or 0 where they must not be.
  Lighting(const Scene& scene, const glm::dvec3& zero);
  /// False for plain emission and absorption: then the other functions are not needed.
  bool any() const { return shading_ || shadows_; }
  bool shadows() const { return shadows_; }
  bool shading() const { return shading_; }
  /// At least one.
  const std::vector<Light>& lights() const { return lights_; }

  /// All lights at `point` on a ray that begins at `eye`, taken as visible.
  std::vector<ArrivingLight> arriving(const glm::dvec3& point, const glm::dvec3& eye) const;
  /// Radiance of matter of emission `color`. `steepness` is |gradient| x smallest spacing / |hi - lo|;
  /// `toViewer` has length 1.
  glm::dvec3 radiance(const Material& material, const glm::dvec3& color, const glm::dvec3& gradient,
                      double steepness, const glm::dvec3& toViewer,
                      std::span<const ArrivingLight> lights) const;
  /// Upper bound of any component of radiance(), if no component of the emission exceeds `color`.
  double brightest(const Material& material, double color) const;

 private:
  bool shading_, shadows_;
  std::vector<Light> lights_;
};

}  // namespace scolopax::reference
