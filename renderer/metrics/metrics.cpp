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

void checkComparable(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height)
    throw Error(ErrorCode::badInput,
                "compare: the pictures must have one size, found " + sizeOf(a) + " and " + sizeOf(b));
  if (a.pixels.empty() || a.pixels.size() != b.pixels.size())
    throw Error(ErrorCode::badInput, "compare: there must be at least one pixel, found " + sizeOf(a));
}

ImageDifference compareImages(const Image& a, const Image& b) {
  checkComparable(a, b);
  double sum = 0, maximum = 0, relative = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      const double reference = b.pixels[i][c];
      const double difference = std::abs(double(a.pixels[i][c]) - reference);
      if (std::isnan(difference)) return {difference, difference, difference, difference};
      sum += difference * difference;
      maximum = std::max(maximum, difference);
      relative += std::isinf(difference)
                      ? difference
                      : difference * difference / (reference * reference + kRelativeEpsilon);
    }
  const double components = 4.0 * double(a.pixels.size());
  const double rmse = std::sqrt(sum / components);
  return {rmse, -20 * std::log10(rmse), maximum, relative / components};
}

}  // namespace scolopax
