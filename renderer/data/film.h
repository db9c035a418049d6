// SPDX-License-Identifier: Apache-2.0
// Running sums per pixel, in double so that ten million samples do not drift. Takes passes from a launcher;
// gives images and the estimated error.
#pragma once
#include <cstdint>
#include <glm/vec4.hpp>
#include <vector>

#include "renderer/core/raw_vector.h"
#include "renderer/data/image.h"

namespace scolopax {

/// From this many pixels on, processing a whole picture takes long enough to delay other work.
inline constexpr std::uint64_t kLargePicture = 1 << 20;

class Film {
 public:
  /// Empties the film and sets its size. Fast, as the first sample is what fills the memory. Throws
  /// Error(tooLarge) if the memory cannot be allocated.
  void reset(int width, int height);
  /// Buffer that a launcher fills with one sample of every pixel, width x height; add() commits it, otherwise
  /// it is lost.
  glm::vec4* pass() { return pass_.data(); }
  /// Adds the pass to every pixel.
  void add();
  /// Bytes of memory per pixel.
  static constexpr std::size_t kPixelBytes = sizeof(glm::vec4) + 2 * sizeof(glm::dvec4) + 2 * sizeof(double);
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t pixelCount() const { return sum_.size(); }
  std::uint32_t samples() const { return samples_; }
  /// Mean of the samples; all zero when there are none.
  Image image() const;
  /// 1 - alpha of image(), for each pixel.
  std::vector<float> transmittance() const;
  /// Estimated RMSE over linear premultiplied RGBA of image(); NaN with fewer than two samples. With at least
  /// kEnoughReplicates replicates, it comes from the variance between them, because they are independent.
  /// Before that, it comes from the variance of the samples, which overestimates the error of low-discrepancy
  /// sampling, for a marcher by far.
  double estimatedError() const;
  static constexpr std::uint32_t kEnoughReplicates = 16;

 private:
  int width_ = 0, height_ = 0;
  std::uint32_t samples_ = 0;
  RawVector<glm::vec4> pass_;
  // Undefined until there is a sample.
  RawVector<glm::dvec4> sum_;
  RawVector<double> squares_;  // sum of r^2 + g^2 + b^2 + a^2
  // The same over whole replicates of kernel::kReplicateSamples samples.
  RawVector<glm::dvec4> replicate_;  // sum over the current, incomplete one
  RawVector<double> replicateSquares_;
};

}  // namespace scolopax
