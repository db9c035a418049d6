// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/film.h"

#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <new>

#include "renderer/core/error.h"
#include "renderer/data/pixel_loops.h"
#include "renderer/kernel/rng.h"

namespace scolopax {
namespace {

static_assert(kernel::kScramblings == 2);

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Sum of f(i) over pixels; the same bits for any number of threads.
template <class F>
double sumOverPixels(std::size_t pixels, const F& f) {
  const auto add = [&](const tbb::blocked_range<std::size_t>& range, double sum) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) sum += f(i);
    return sum;
  };
  return tbb::parallel_deterministic_reduce(pixelRange(pixels), 0.0, add, std::plus<>());
}

double squaredLength(const glm::dvec4& v) { return glm::dot(v, v); }

}  // namespace

template <class Sum>
void HalvedSums<Sum>::reset(std::size_t pixels) {
  passes_ = 0;
  for (RawVector<Sum>& half : halves_) half.resize(pixels);
}

template <class Sum>
template <class Value>
void HalvedSums<Sum>::add(const Value& value) {
  Sum* const half = halves_[passes_ % 2].data();
  const bool first = passes_ < 2;
  forEachPixel(pixels(), [&](std::size_t i) {
    const Sum v(value(i));
    half[i] = first ? v : half[i] + v;
  });
  ++passes_;
}

template <class Sum>
glm::dvec4 HalvedSums<Sum>::mean(std::size_t pixel) const {
  glm::dvec4 sum(halves_[0][pixel]);
  if (passes_ > 1) sum += glm::dvec4(halves_[1][pixel]);
  return sum / double(passes_);
}

template <class Sum>
template <class F>
double HalvedSums<Sum>::sumOverHalves(const F& f) const {
  const std::uint32_t half = passes_ / 2;
  const double odd = half, even = passes_ - half;
  return sumOverPixels(pixels(), [&](std::size_t i) {
    return f(glm::dvec4(halves_[0][i]) / even, glm::dvec4(halves_[1][i]) / odd);
  });
}

template <class Sum>
double HalvedSums<Sum>::variance() const {
  if (passes_ < 2) return kNaN;
  // The variance of a mean of n samples is 1/n of a sample's, and that of the difference between the means
  // of the halves is 1/even + 1/odd of it.
  const std::uint32_t half = passes_ / 2;
  const double odd = half, even = passes_ - half, all = passes_;
  return even * odd / (all * all) *
         sumOverHalves([](const glm::dvec4& a, const glm::dvec4& b) { return squaredLength(a - b); });
}

template <class Sum>
double HalvedSums<Sum>::squaredSignal() const {
  if (passes_ < 2) return kNaN;
  return sumOverHalves([](const glm::dvec4& a, const glm::dvec4& b) { return glm::dot(a, b); });
}

void Film::reset(int width, int height) {
  const std::size_t count = std::size_t(width) * std::size_t(height);
  width_ = width;
  height_ = height;
  corrections_.clear();
  included_.clear();
  fine_ = {};
  coarse_ = {};
  try {
    pass_.resize(count);
    base_.reset(count);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::tooLarge, "image: not enough memory for " + std::to_string(width) + "x" +
                                         std::to_string(height) + " pixels");
  }
}

void Film::add() {
  base_.add([&](std::size_t i) { return pass_[i]; });
}

void Film::addLevel() {
  try {
    fine_.resize(pixelCount());
    coarse_.resize(pixelCount());
    HalvedSums<glm::vec4> sums;
    sums.reset(pixelCount());
    corrections_.push_back(std::move(sums));
    included_.push_back(false);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::tooLarge, "image: not enough memory for corrections of " + std::to_string(width_) +
                                         "x" + std::to_string(height_) + " pixels");
  }
}

void Film::addCorrection(std::size_t level) {
  corrections_[level].add([&](std::size_t i) { return fine_[i] - coarse_[i]; });
}

double Film::correctionSize(std::size_t level) const {
  const double components = 4.0 * double(pixelCount());
  // The standard deviation of the estimate, if all of its components have the same noise: with variance s^2
  // of a half's mean, that of a product is s^2, and the variance of the mean is s^2 / 2.
  const double deviation = 2 * corrections_[level].variance() / std::sqrt(components);
  return std::sqrt((std::max(0.0, corrections_[level].squaredSignal()) + deviation) / components);
}

glm::dvec4 Film::mean(std::size_t pixel) const {
  glm::dvec4 sum = base_.mean(pixel);
  for (std::size_t l = 0; l < corrections_.size(); ++l)
    if (included_[l]) sum += corrections_[l].mean(pixel);
  return sum;
}

Image Film::image() const {
  Image image{width_, height_, std::vector<glm::vec4>(pixelCount())};
  if (samples() > 0) forEachPixel(pixelCount(), [&](std::size_t i) { image.pixels[i] = glm::vec4(mean(i)); });
  return image;
}

std::vector<float> Film::transmittance() const {
  std::vector<float> values(pixelCount(), 1.0f);
  if (samples() > 0) forEachPixel(pixelCount(), [&](std::size_t i) { values[i] = 1.0f - float(mean(i).a); });
  return values;
}

double Film::noise() const {
  double sum = base_.variance();
  for (std::size_t l = 0; l < corrections_.size(); ++l) {
    if (!included_[l]) continue;
    const auto& level = corrections_[l];
    sum += level.passes() > 1
               ? level.variance()
               : sumOverPixels(pixelCount(), [&](std::size_t i) { return squaredLength(level.mean(i)); });
  }
  return std::sqrt(sum / (4.0 * double(pixelCount())));
}

}  // namespace scolopax
