// SPDX-License-Identifier: Apache-2.0
#include "server/hex_color.h"

#include <cmath>
#include <cstdio>

#include "renderer/data/image.h"

namespace scolopax::server {

std::string hexOf(const std::array<std::uint8_t, 3>& color) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "#%02x%02x%02x", color[0], color[1], color[2]);
  return text.data();
}

std::string hexOf(const glm::dvec3& linear) {
  const auto byte = [](double v) {
    return std::uint8_t(std::lround(double(srgbFromLinear(float(v))) * 255));
  };
  return hexOf(std::array{byte(linear.r), byte(linear.g), byte(linear.b)});
}

glm::dvec3 linearOf(const std::string& hex) {
  const auto part = [&](std::size_t at) {
    return double(linearFromSrgb(float(std::stoi(hex.substr(at, 2), nullptr, 16)) / 255.0f));
  };
  return {part(1), part(3), part(5)};
}

}  // namespace scolopax::server
