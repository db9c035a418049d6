// SPDX-License-Identifier: Apache-2.0
// Lights and materials as the scene gives them, in world space.
#pragma once
#include <glm/vec3.hpp>

#include "renderer/data/method.h"

namespace scolopax {

/// directional: `vector` is the direction in which the light travels, away from its source; point: `vector`
/// is its position, without fall-off; headlight: shines from the eye, `vector` is not used.
struct Light {
  LightType type = LightType::headlight;
  glm::dvec3 vector{0, 0, -1};
  glm::dvec3 color{1};   ///< linear RGB, not negative
  double intensity = 1;  ///< not negative
  bool operator==(const Light&) const = default;
};

/// Blinn-Phong; ambient, diffuse and specular not negative, shininess > 0.
struct Material {
  double ambient = 0.3, diffuse = 0.7, specular = 0.2, shininess = 20;
  bool operator==(const Material&) const = default;
};

}  // namespace scolopax
