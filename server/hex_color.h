// SPDX-License-Identifier: Apache-2.0
// Converts colours between the form of scenes and capabilities, "#rrggbb" in sRGB, and the renderer's linear
// RGB.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>

namespace scolopax::server {

std::string hexOf(const std::array<std::uint8_t, 3>& color);
/// `linear`: RGB, each in [0, 1].
std::string hexOf(const glm::dvec3& linear);
/// Linear RGB; `hex` must be valid.
glm::dvec3 linearOf(const std::string& hex);

}  // namespace scolopax::server
