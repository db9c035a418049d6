// SPDX-License-Identifier: Apache-2.0
#include "renderer/metrics/metrics.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "renderer/core/error.h"

namespace scolopax {
namespace {

std::string sizeOf(const Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

}  // namespace

ImageDifference compareImages(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height)
    throw Error(ErrorCode::badInput,
                "compare: the pictures must have one size, found " + sizeOf(a) + " and " + sizeOf(b));
  if (a.pixels.empty() || a.pixels.size() != b.pixels.size())
    throw Error(ErrorCode::badInput, "compare: there must be at least one pixel, found " + sizeOf(a));
  double sum = 0, maximum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const double difference = std::abs(double(a.pixels[i][c]) - double(b.pixels[i][c]));
      if (std::isnan(difference)) return {difference, difference, difference};
      sum += difference * difference;
      maximum = std::max(maximum, difference);
    }
  const double rmse = std::sqrt(sum / (3.0 * double(a.pixels.size())));
  return {rmse, -20 * std::log10(rmse), maximum};
}

}  // namespace scolopax
