// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/pick.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "renderer/kernel/views.h"

namespace scolopax {
namespace {
constexpr int kLeastSide = 2;
constexpr std::size_t kMaxRays = std::size_t(kMaxPickPixels) * kLeastSide * kLeastSide;
/// A pixel shows nothing if fewer than one in this many of its samples have a collision. One in sixteen is
/// well below one half, so that what is faint but visible can be picked.
constexpr std::size_t kLeastShare = 16;
}  // namespace

std::vector<glm::ivec2> pixelsToPick(const PixelArea& area) {
  // All columns and rows, or a lattice in the proportions of the area.
  const double proportion = double(area.width) / double(area.height);
  int columns = std::clamp(int(std::sqrt(kMaxPickPixels * proportion)), 1, area.width);
  const int rows = std::clamp(kMaxPickPixels / columns, 1, area.height);
  columns = std::min(area.width, kMaxPickPixels / rows);
  const auto place = [](int i, int count, int length) {
    return int((2 * std::int64_t(i) + 1) * length / (2 * std::int64_t(count)));
  };
  std::vector<glm::ivec2> pixels;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      pixels.emplace_back(area.left + place(column, columns, area.width),
                          area.top + place(row, rows, area.height));
  return pixels;
}

int pickSamplesSide(std::size_t pixels) {
  int side = kMaxPickSamplesSide;
  while (side > kLeastSide && std::size_t(side * side) * pixels > kMaxRays) side /= 2;
  return side;
}

std::optional<std::size_t> visibleSample(std::span<const kernel::FirstCollision> samples) {
  std::array<std::size_t, kernel::kMaxVisibleChannels> ends{};
  std::size_t all = 0;
  for (const auto& sample : samples) {
    if (sample.channel < 0) continue;
    ++ends[std::size_t(sample.channel)];
    ++all;
  }
  if (all == 0 || all * kLeastShare < samples.size()) return std::nullopt;
  const auto channel = std::max_element(ends.begin(), ends.end()) - ends.begin();
  std::vector<std::size_t> those;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (samples[i].channel == channel) those.push_back(i);
  const auto median = those.begin() + std::ptrdiff_t((those.size() - 1) / 2);
  std::nth_element(those.begin(), median, those.end(), [&](std::size_t a, std::size_t b) {
    return samples[a].depth != samples[b].depth ? samples[a].depth < samples[b].depth : a < b;
  });
  return *median;
}

}  // namespace scolopax
