// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/colormap.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "renderer/core/error.h"
#include "renderer/data/image.h"

namespace scolopax {
namespace {

constexpr NamedValue kColormaps[] = {
    {"gray", "black to white, even in lightness"},
    {"viridis", "dark violet to yellow, perceptually even"},
    {"magma", "black to light yellow through purple, perceptually even"},
    {"inferno", "black to light yellow through red, perceptually even"},
    {"plasma", "blue to yellow through red, perceptually even"},
    {"turbo", "a rainbow without false bands"},
    {"fire", "ImageJ's Fire: black, blue, red, yellow, white"},
    {"hot", "black, red, yellow, white"},
};

double linearFromSrgb8(double code) { return double(linearFromSrgb(float(code / 255.0))); }

std::vector<ColorKnot> fromSrgb8(std::span<const std::array<int, 3>> colors) {
  std::vector<ColorKnot> knots;
  for (std::size_t i = 0; i < colors.size(); ++i)
    knots.push_back(
        {double(i) / double(colors.size() - 1),
         {linearFromSrgb8(colors[i][0]), linearFromSrgb8(colors[i][1]), linearFromSrgb8(colors[i][2])}});
  return knots;
}

/// The Fire lookup table that ImageJ (public domain) interpolates.
constexpr std::array<int, 3> kFire[] = {
    {0, 0, 0},       {0, 0, 61},     {1, 0, 96},    {25, 0, 130},   {49, 0, 165},   {73, 0, 192},
    {98, 0, 220},    {122, 0, 227},  {146, 0, 210}, {162, 0, 181},  {173, 0, 151},  {184, 0, 122},
    {195, 0, 93},    {207, 14, 64},  {217, 35, 35}, {229, 57, 5},   {240, 79, 0},   {252, 101, 0},
    {255, 117, 0},   {255, 133, 0},  {255, 147, 0}, {255, 161, 0},  {255, 175, 0},  {255, 190, 0},
    {255, 205, 0},   {255, 219, 0},  {255, 234, 0}, {255, 248, 35}, {255, 255, 98}, {255, 255, 160},
    {255, 255, 223}, {255, 255, 255}};

/// The classic hot map: red rises over 3/8 of the range, then green, then blue (in display values).
std::vector<ColorKnot> hot() {
  std::vector<std::array<int, 3>> colors;
  const auto ramp = [](double x) { return int(std::lround(255 * std::clamp(x, 0.0, 1.0))); };
  for (int i = 0; i < 257; ++i) {
    const double x = i / 256.0;
    colors.push_back({ramp(x / 0.375), ramp((x - 0.375) / 0.375), ramp((x - 0.75) / 0.25)});
  }
  return fromSrgb8(colors);
}

std::vector<ColorKnot> gray() {
  std::vector<std::array<int, 3>> colors;
  colors.reserve(256);
  for (int i = 0; i < 256; ++i) colors.push_back({i, i, i});
  return fromSrgb8(colors);
}

/// The perceptual maps come from OpenImageIO, as linear values.
std::vector<ColorKnot> fromOpenImageIo(std::string_view name) {
  constexpr int kSteps = 256;
  OIIO::ImageBuf ramp(OIIO::ImageSpec(kSteps, 1, 1, OIIO::TypeDesc::FLOAT));
  for (int i = 0; i < kSteps; ++i) {
    const float x = float(i) / float(kSteps - 1);
    ramp.setpixel(i, 0, &x);
  }
  const OIIO::ImageBuf mapped = OIIO::ImageBufAlgo::color_map(ramp, 0, std::string(name), {}, 1);
  std::vector<ColorKnot> knots;
  for (int i = 0; i < kSteps; ++i) {
    float rgb[3];
    mapped.getpixel(i, 0, rgb, 3);
    knots.push_back({double(i) / double(kSteps - 1), {rgb[0], rgb[1], rgb[2]}});
  }
  return knots;
}

/// Leaves out knots that the others give as well: the tables of these maps are in 8-bit sRGB, so that half of
/// its levels is all that they say. A segment of a ray takes as long as it has knots.
std::vector<ColorKnot> simplified(const std::vector<ColorKnot>& table) {
  const auto isGiven = [&](std::size_t first, std::size_t last, std::size_t knot) {
    const ColorKnot &a = table[first], &b = table[last], &k = table[knot];
    const glm::dvec3 line =
        a.color + (k.position - a.position) / (b.position - a.position) * (b.color - a.color);
    for (int c = 0; c < 3; ++c)
      if (std::abs(srgbFromLinear(float(line[c])) - srgbFromLinear(float(k.color[c]))) > 0.5f / 255)
        return false;
    return true;
  };
  std::vector<ColorKnot> knots{table.front()};
  for (std::size_t first = 0, last = 1; first + 1 < table.size(); first = last) {
    const auto reaches = [&](std::size_t to) {
      for (std::size_t knot = first + 1; knot < to; ++knot)
        if (!isGiven(first, to, knot)) return false;
      return true;
    };
    last = first + 1;
    while (last + 1 < table.size() && reaches(last + 1)) ++last;
    knots.push_back(table[last]);
  }
  return knots;
}

}  // namespace

std::span<const NamedValue> colormaps() { return kColormaps; }

std::vector<ColorKnot> colormapKnots(std::string_view name) {
  if (name == "gray") return simplified(gray());
  if (name == "fire") return fromSrgb8(kFire);
  if (name == "hot") return simplified(hot());
  std::string known;
  for (const NamedValue& map : kColormaps) {
    if (map.name == name) return simplified(fromOpenImageIo(name));
    known += (known.empty() ? "" : ", ") + std::string(map.name);
  }
  throw Error(ErrorCode::notFound,
              "colormap: expected one of " + known + ", found '" + std::string(name) + "'");
}

}  // namespace scolopax
