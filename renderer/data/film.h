// SPDX-License-Identifier: Apache-2.0
// Running sums per pixel, in double: ten million samples do not drift. Takes passes from a launcher, gives
// images and the estimated error.
#pragma once
#include <cstdint>
#include <glm/vec4.hpp>
#include <vector>

#include "renderer/core/raw_vector.h"
#include "renderer/data/image.h"

namespace scolopax {

/// From so many pixels on, what is done with all of them at once takes long enough to hold others up.
inline constexpr std::uint64_t kLargePicture = 1 << 20;

class Film {
 public:
  /// Empties the film and sets its size. Takes no time: the first sample fills the memory. Throws
  /// Error(tooLarge) when it cannot be had.
  void reset(int width, int height);
  /// Where a launcher puts one sample of every pixel, width x height; committed by add(), otherwise lost.
  glm::vec4* pass() { return pass_.data(); }
  /// Adds the pass to every pixel.
  void add();
  /// Of memory, for each pixel.
  static constexpr std::size_t kPixelBytes = sizeof(glm::vec4) + 2 * sizeof(glm::dvec4) + 2 * sizeof(double);
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t pixelCount() const { return sum_.size(); }
  std::uint32_t samples() const { return samples_; }
  /// Mean of the samples; all zero when there are none.
  Image image() const;
  /// 1 - alpha of image(), for each pixel.
  std::vector<float> transmittance() const;
  /// Estimated RMSE over linear premultiplied RGBA of image(); NaN below two samples. From the variance
  /// between replicates, which are independent, as soon as there are kEnoughReplicates of them. Before, from
  /// the samples' variance, which is too large where sampling is of low discrepancy: an upper estimate, for a
  /// marcher by far.
  double estimatedError() const;
  static constexpr std::uint32_t kEnoughReplicates = 16;

 private:
  int width_ = 0, height_ = 0;
  std::uint32_t samples_ = 0;
  RawVector<glm::vec4> pass_;
  // Undefined as long as there is no sample.
  RawVector<glm::dvec4> sum_;
  RawVector<double> squares_;  // sum of r^2 + g^2 + b^2 + a^2
  // The same over whole replicates of kernel::kReplicateSamples samples.
  RawVector<glm::dvec4> replicate_;  // sum over the one that has begun
  RawVector<double> replicateSquares_;
};

}  // namespace scolopax
