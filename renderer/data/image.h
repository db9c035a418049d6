// SPDX-License-Identifier: Apache-2.0
// A finished picture: linear, premultiplied RGBA, and its 8-bit sRGB form. Comes from Film; goes to
// files, encoders and metrics.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

namespace scolopax {

struct Image {
  int width = 0, height = 0;
  std::vector<glm::vec4> pixels;  ///< width x height, top row first; linear premultiplied RGBA
};

/// 8-bit sRGB, 3 bytes per pixel, composited over `background` (linear RGB); values are clipped only here.
struct Image8 {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
Image8 toSrgb8(const Image& image, glm::vec3 background);

/// IEC 61966-2-1 transfer, one component; in and out in [0,1] (not clamped).
float srgbFromLinear(float linear);
float linearFromSrgb(float encoded);

}  // namespace scolopax
