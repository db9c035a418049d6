// SPDX-License-Identifier: Apache-2.0
// Lights and materials as kernels read them. data/scene_view and data/transfer_function fill them; shade.h
// evaluates them.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>

namespace scolopax::kernel {

/// Blinn-Phong coefficients of one channel.
struct MaterialView {
  float ambient, diffuse, specular, shininess;
};

enum class LightKind : std::uint8_t { directional, point, headlight };

struct LightView {
  LightKind kind;
  glm::vec3 vector;     ///< directional: towards the light in voxel space, of length 1 in world units; point:
                        ///< the light's position in voxel coordinates
  glm::vec3 intensity;  ///< linear colour times intensity
};
inline constexpr int kMaxLights = 8;

}  // namespace scolopax::kernel
