// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/aov.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "renderer/data/colormap.h"
#include "renderer/data/defaults.h"
#include "renderer/data/pixel_loops.h"

namespace scolopax {
namespace {

constexpr float kUndefined = std::numeric_limits<float>::quiet_NaN();

/// Smallest and largest defined value; {0, 0} if there is none.
std::pair<float, float> rangeOf(std::span<const float> values) {
  float lo = std::numeric_limits<float>::infinity(), hi = -lo;
  for (const float v : values)
    if (!std::isnan(v)) lo = std::min(lo, v), hi = std::max(hi, v);
  return lo <= hi ? std::pair{lo, hi} : std::pair{0.0f, 0.0f};
}

glm::vec3 defaultLinearColor(int channel) {
  const auto rgb = defaultColor(channel);
  return {linearFromSrgb(float(rgb[0]) / 255), linearFromSrgb(float(rgb[1]) / 255),
          linearFromSrgb(float(rgb[2]) / 255)};
}

glm::vec3 heat(float at) {
  static const std::vector<ColorKnot> knots = colormapKnots("inferno");
  return glm::vec3(knots[std::size_t(std::lround(at * float(knots.size() - 1)))].color);
}

template <class Color>
Image imageOf(const AovValues& aov, Color&& color) {
  Image image{aov.width, aov.height, {}};
  image.pixels.reserve(aov.values.size());
  for (const float v : aov.values)
    image.pixels.push_back(std::isnan(v) ? glm::vec4(0) : glm::vec4(color(v), 1.0f));
  return image;
}

}  // namespace

std::optional<Aov> aovOf(std::string_view name) {
  const auto found = std::find_if(std::begin(kAovs), std::end(kAovs),
                                  [&](const NamedValue& aov) { return aov.name == name; });
  if (found == std::end(kAovs)) return std::nullopt;
  return Aov(found - std::begin(kAovs));
}

std::string aovNames() {
  std::string names;
  for (const NamedValue& aov : kAovs) names.append(names.empty() ? "" : ", ").append(aov.name);
  return names;
}

Image aovImage(const AovValues& aov) {
  return imageOf(aov, [](float v) { return glm::vec3(v); });
}

Image aovPicture(const AovValues& aov) {
  const auto [lo, hi] = rangeOf(aov.values);
  switch (aov.aov) {
    case Aov::depth: {
      const float nearest = lo, extent = hi > lo ? hi - lo : 1.0f;
      return imageOf(
          aov, [=](float v) { return glm::vec3(linearFromSrgb(1.0f - 0.85f * (v - nearest) / extent)); });
    }
    case Aov::transmittance:
      return imageOf(aov, [](float v) { return glm::vec3(linearFromSrgb(std::clamp(v, 0.0f, 1.0f))); });
    case Aov::channel:
      return imageOf(aov, [](float v) { return defaultLinearColor(int(v)); });
    case Aov::cost:
      break;
  }
  const float largest = hi > 0 ? hi : 1.0f;
  return imageOf(aov, [=](float v) { return heat(v / largest); });
}

void FirstCollisions::reset(std::size_t pixels, std::size_t channels) {
  channels_ = channels;
  pass_.assign(pixels, {});
  depthSum_.assign(pixels, 0);
  hits_.assign(pixels * channels, 0);
}

void FirstCollisions::add(std::span<const int> volumeChannels) {
  forEachPixel(pass_.size(), [&](std::size_t i) {
    if (pass_[i].channel < 0) return;
    depthSum_[i] += double(pass_[i].depth);
    ++hits_[i * channels_ + std::size_t(volumeChannels[std::size_t(pass_[i].channel)])];
  });
}

std::vector<float> FirstCollisions::depth() const {
  std::vector<float> depth(depthSum_.size(), kUndefined);
  forEachPixel(depth.size(), [&](std::size_t i) {
    const auto first = hits_.begin() + std::ptrdiff_t(i * channels_);
    const auto hits = std::accumulate(first, first + std::ptrdiff_t(channels_), std::uint64_t(0));
    if (hits > 0) depth[i] = float(depthSum_[i] / double(hits));
  });
  return depth;
}

std::vector<float> FirstCollisions::channel() const {
  std::vector<float> channel(depthSum_.size(), kUndefined);
  forEachPixel(channel.size(), [&](std::size_t i) {
    const auto first = hits_.begin() + std::ptrdiff_t(i * channels_);
    const auto most = std::max_element(first, first + std::ptrdiff_t(channels_));
    if (*most > 0) channel[i] = float(most - first);
  });
  return channel;
}

}  // namespace scolopax
