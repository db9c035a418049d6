// SPDX-License-Identifier: Apache-2.0
// Colours as scenes and capabilities write them, "#rrggbb" in sRGB, and as the renderer takes them.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>

namespace scolopax::server {

std::string hexOf(const std::array<std::uint8_t, 3>& color);
/// `linear`: RGB, each in [0, 1].
std::string hexOf(const glm::dvec3& linear);
/// Linear RGB of a text that has been checked.
glm::dvec3 linearOf(const std::string& hex);

}  // namespace scolopax::server
