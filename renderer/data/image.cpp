// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/image.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scolopax {
namespace {

/// Linear value at which the rounded 8-bit code becomes i: comparing with these is exact and costs no pow.
const std::array<float, 256>& codeThresholds() {
  static const auto table = [] {
    std::array<float, 256> t{};
    for (std::size_t i = 1; i < 256; ++i) t[i] = linearFromSrgb((float(i) - 0.5f) / 255.0f);
    return t;
  }();
  return table;
}

/// First guess for each of 4096 equal steps of the linear value; a few comparisons at most remain.
const std::array<std::uint8_t, 4097>& firstCodes() {
  static const auto table = [] {
    std::array<std::uint8_t, 4097> t{};
    std::size_t code = 0;
    for (std::size_t i = 0; i < t.size(); ++i) {
      while (code < 255 && codeThresholds()[code + 1] <= float(i) / 4096.0f) ++code;
      t[i] = std::uint8_t(code);
    }
    return t;
  }();
  return table;
}

std::uint8_t encode(float linear) {
  const float x = linear > 0.0f ? std::min(linear, 1.0f) : 0.0f;  // NaN becomes 0
  std::size_t code = firstCodes()[std::size_t(x * 4096.0f)];
  while (code < 255 && codeThresholds()[code + 1] <= x) ++code;
  return std::uint8_t(code);
}

}  // namespace

float srgbFromLinear(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float linearFromSrgb(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Image8 toSrgb8(const Image& image, glm::vec3 background) {
  Image8 out{image.width, image.height, {}};
  out.rgb.resize(image.pixels.size() * 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const glm::vec4& p = image.pixels[i];
    for (int c = 0; c < 3; ++c) out.rgb[i * 3 + std::size_t(c)] = encode(p[c] + (1.0f - p.a) * background[c]);
  }
  return out;
}

}  // namespace scolopax
