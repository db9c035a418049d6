// SPDX-License-Identifier: Apache-2.0
// Running sums per pixel. Takes passes from a launcher; gives images and their noise. The picture is the mean
// of the samples plus, for every level of multi-level quadrature, the mean of that level's corrections.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec4.hpp>
#include <vector>

#include "renderer/core/raw_vector.h"
#include "renderer/data/image.h"

namespace scolopax {

/// From this many pixels on, processing a whole picture takes long enough to delay other work.
inline constexpr std::uint64_t kLargePicture = 1 << 20;

/// Sums of what passes add to the pixels, in two halves: passes 0, 2, 4, ... and 1, 3, 5, ... The halves are
/// independent of each other (kernel::kScramblings), so their difference tells the noise of the mean.
template <class Sum>
class HalvedSums {
 public:
  static constexpr std::size_t kPixelBytes = 2 * sizeof(Sum);
  /// Forgets all passes. Fast: only the first pass of each half fills memory. Throws std::bad_alloc.
  void reset(std::size_t pixels);
  std::size_t pixels() const { return halves_[0].size(); }
  std::uint32_t passes() const { return passes_; }
  /// Adds a pass: value(i) to pixel i.
  template <class Value>
  void add(const Value& value);
  /// Mean of the passes; needs one.
  glm::dvec4 mean(std::size_t pixel) const;
  /// Variance of the mean, summed over pixels and components. NaN with fewer than two passes.
  double variance() const;
  /// Square of the expected mean, summed over pixels and components: an estimate without bias, which may be
  /// negative. NaN with fewer than two passes.
  double squaredSignal() const;

 private:
  /// Sum over pixels of f(mean of the even passes, mean of the odd ones).
  template <class F>
  double sumOverHalves(const F& f) const;

  std::uint32_t passes_ = 0;
  std::array<RawVector<Sum>, 2> halves_;  // undefined until the half has a pass
};

class Film {
 public:
  /// Empties the film and sets its size. Throws Error(tooLarge) if the memory cannot be allocated.
  void reset(int width, int height);
  /// Bytes of memory per pixel, without corrections.
  static constexpr std::size_t kPixelBytes = sizeof(glm::vec4) + HalvedSums<glm::dvec4>::kPixelBytes;
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t pixelCount() const { return pass_.size(); }

  /// Buffer that a launcher fills with one sample of every pixel, width x height; add() commits it, otherwise
  /// it is lost.
  glm::vec4* pass() { return pass_.data(); }
  /// Adds the pass to every pixel.
  void add();
  std::uint32_t samples() const { return base_.passes(); }

  /// Bytes per pixel that the first level takes, and every other one.
  static constexpr std::size_t kFirstLevelBytes = 2 * sizeof(glm::vec4) + HalvedSums<glm::vec4>::kPixelBytes;
  static constexpr std::size_t kLevelBytes = HalvedSums<glm::vec4>::kPixelBytes;
  /// Makes room for one more level of corrections. Throws Error(tooLarge) if the memory cannot be allocated.
  void addLevel();
  std::size_t levels() const { return corrections_.size(); }
  /// Buffers for the two pictures whose difference is a correction: at a level's finer resolution, and
  /// at its coarser one. Null without levels.
  glm::vec4* fine() { return fine_.data(); }
  glm::vec4* coarse() { return coarse_.data(); }
  /// Adds fine() - coarse() to the corrections of a level.
  void addCorrection(std::size_t level);
  /// From now on, the level's corrections are part of the picture. Before, while they are few, their noise
  /// may be larger than what they correct. Needs a correction.
  void include(std::size_t level) { included_[level] = true; }
  bool isIncluded(std::size_t level) const { return included_[level]; }
  /// Number of corrections of a level.
  std::uint32_t corrections(std::size_t level) const { return corrections_[level].passes(); }
  /// RMS of a level's expected correction, over linear premultiplied RGBA, one standard deviation above the
  /// estimate; NaN with fewer than two corrections.
  double correctionSize(std::size_t level) const;

  /// Mean of the samples plus the means of the corrections that are included; all zero when there are no
  /// samples.
  Image image() const;
  /// 1 - alpha of image(), for each pixel.
  std::vector<float> transmittance() const;
  /// Estimated RMSE of image() over linear premultiplied RGBA, as far as it comes from noise: that of
  /// the samples and of the levels which are included. NaN with fewer than two samples. A single correction
  /// counts as noise of its own size.
  double noise() const;

 private:
  glm::dvec4 mean(std::size_t pixel) const;

  int width_ = 0, height_ = 0;
  RawVector<glm::vec4> pass_, fine_, coarse_;
  HalvedSums<glm::dvec4> base_;  // in double, so that ten million samples do not drift
  std::vector<HalvedSums<glm::vec4>> corrections_;
  std::vector<bool> included_;  // one per level
};

}  // namespace scolopax
