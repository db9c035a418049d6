// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/film.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <new>

#include "renderer/core/error.h"
#include "renderer/kernel/rng.h"

namespace scolopax {
namespace {

double squaredLength(const glm::dvec4& v) { return glm::dot(v, v); }

}  // namespace

void Film::reset(int width, int height) {
  const std::size_t count = std::size_t(width) * std::size_t(height);
  width_ = width;
  height_ = height;
  samples_ = 0;
  try {
    pass_.resize(count);
    sum_.resize(count);
    squares_.resize(count);
    replicate_.resize(count);
    replicateSquares_.resize(count);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::tooLarge, "image: not enough memory for " + std::to_string(width) + "x" +
                                         std::to_string(height) + " pixels");
  }
}

void Film::add() {
  const bool first = samples_ == 0;
  const bool replicateEnds = (samples_ + 1) % kernel::kReplicateSamples == 0;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pass_.size(), 1 << 14),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        const glm::dvec4 v(pass_[i]);
                        if (first) {
                          sum_[i] = glm::dvec4(0);
                          squares_[i] = replicateSquares_[i] = 0;
                          replicate_[i] = glm::dvec4(0);
                        }
                        sum_[i] += v;
                        squares_[i] += squaredLength(v);
                        replicate_[i] += v;
                        if (!replicateEnds) continue;
                        replicateSquares_[i] += squaredLength(replicate_[i]);
                        replicate_[i] = glm::dvec4(0);
                      }
                    });
  ++samples_;
}

Image Film::image() const {
  Image image{width_, height_, std::vector<glm::vec4>(sum_.size())};
  if (samples_ == 0) return image;
  const double scale = 1.0 / samples_;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, sum_.size(), 1 << 14), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) image.pixels[i] = glm::vec4(sum_[i] * scale);
  });
  return image;
}

std::vector<float> Film::transmittance() const {
  std::vector<float> values(sum_.size(), 1.0f);
  if (samples_ == 0) return values;
  const double scale = 1.0 / samples_;
  std::transform(sum_.begin(), sum_.end(), values.begin(),
                 [&](const glm::dvec4& sum) { return 1.0f - float(sum.a * scale); });
  return values;
}

double Film::estimatedError() const {
  if (samples_ < 2) return std::numeric_limits<double>::quiet_NaN();
  const std::uint32_t replicates = samples_ / kernel::kReplicateSamples;
  const bool enough = replicates >= kEnoughReplicates;
  // Number of independent parts of a pixel's sum: complete replicates, or single samples.
  const double n = enough ? replicates : samples_;
  const auto add = [&](const tbb::blocked_range<std::size_t>& range, double sum) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const glm::dvec4 whole = sum_[i] - (enough ? replicate_[i] : glm::dvec4(0));
      const double squares = enough ? replicateSquares_[i] : squares_[i];
      sum += std::max(0.0, squares - squaredLength(whole) / n);
    }
    return sum;
  };
  // Squared deviations of the parts, summed over pixels and components; the same bits for any number of
  // threads.
  const double deviations = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, sum_.size(), 1 << 14), 0.0, add, std::plus<>());
  const double samplesPerPart = enough ? kernel::kReplicateSamples : 1;
  // An incomplete replicate is not counted: its samples are not yet as evenly distributed.
  const double varianceOfMeans = deviations / (n - 1) / (samplesPerPart * samplesPerPart * n);
  return std::sqrt(varianceOfMeans / (4.0 * double(sum_.size())));
}

}  // namespace scolopax
