// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/film.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "renderer/core/error.h"

namespace scolopax {

void Film::reset(int width, int height) {
  const std::size_t count = std::size_t(width) * std::size_t(height);
  width_ = width;
  height_ = height;
  samples_ = 0;
  try {
    pass_.resize(count);
    sum_.assign(count, glm::dvec4(0));
    squares_.assign(count, 0);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::tooLarge,
                "image: no memory for " + std::to_string(width) + "x" + std::to_string(height));
  }
}

void Film::add() {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pass_.size(), 1 << 14),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        const glm::dvec4 v(pass_[i]);
                        sum_[i] += v;
                        squares_[i] += v.r * v.r + v.g * v.g + v.b * v.b;
                      }
                    });
  ++samples_;
}

Image Film::image() const {
  Image image{width_, height_, std::vector<glm::vec4>(sum_.size(), glm::vec4(0))};
  const double scale = samples_ > 0 ? 1.0 / samples_ : 0.0;
  for (std::size_t i = 0; i < sum_.size(); ++i) image.pixels[i] = glm::vec4(sum_[i] * scale);
  return image;
}

double Film::estimatedError() const {
  if (samples_ < 2) return std::numeric_limits<double>::quiet_NaN();
  const double n = samples_;
  double variance = 0;  // of the means, summed over pixels and components
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    const glm::dvec4& s = sum_[i];
    variance += std::max(0.0, squares_[i] - (s.r * s.r + s.g * s.g + s.b * s.b) / n);
  }
  return std::sqrt(variance / (n * (n - 1)) / (3.0 * double(sum_.size())));
}

}  // namespace scolopax
