// SPDX-License-Identifier: Apache-2.0
#include "server/blend.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace scolopax::server {
namespace {

/// Two neighbouring pixels along an axis, and the weight of the second.
struct Neighbours {
  int first, second;
  float share;
};

/// The neighbours of pixel `i` of `full` pixels, among `count` pixels that are `1 / scale` times as large.
Neighbours neighboursOf(int i, int full, int count, double scale) {
  const double at = std::clamp((i + 0.5 - 0.5 * full) * scale + 0.5 * count - 0.5, 0.0, double(count - 1));
  const int first = std::min(int(at), std::max(0, count - 2));
  return {first, std::min(first + 1, count - 1), float(at - first)};
}

}  // namespace

Image enlarged(const Image& image, int width, int height) {
  Image result{width, height, {}};
  result.pixels.reserve(std::size_t(width) * std::size_t(height));
  const double scale = double(image.height) / height;
  for (int y = 0; y < height; ++y) {
    const Neighbours row = neighboursOf(y, height, image.height, scale);
    const glm::vec4* above = &image.pixels[std::size_t(row.first) * std::size_t(image.width)];
    const glm::vec4* below = &image.pixels[std::size_t(row.second) * std::size_t(image.width)];
    for (int x = 0; x < width; ++x) {
      const Neighbours column = neighboursOf(x, width, image.width, scale);
      const auto mix = [&](const glm::vec4* line) {
        return line[column.first] * (1 - column.share) + line[column.second] * column.share;
      };
      result.pixels.push_back(mix(above) * (1 - row.share) + mix(below) * row.share);
    }
  }
  return result;
}

double mixIn(const Image& before, double error, Image* image) {
  double squares = 0;
  for (std::size_t i = 0; i < before.pixels.size(); ++i) {
    const glm::dvec4 d(image->pixels[i] - before.pixels[i]);
    squares += glm::dot(d, d);
  }
  const double difference = squares / (4.0 * double(before.pixels.size()));
  const double share = difference > 0 ? std::clamp(1 - error * error / difference, 0.0, 1.0) : 1;
  for (std::size_t i = 0; i < before.pixels.size(); ++i)
    image->pixels[i] = before.pixels[i] * float(1 - share) + image->pixels[i] * float(share);
  return share;
}

}  // namespace scolopax::server
