// SPDX-License-Identifier: Apache-2.0
// Arbitrary output variables: what else is known of a pixel than its colour. A launcher fills passes, as for
// the film; files and responses take the values.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "renderer/data/image.h"
#include "renderer/data/method.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// One value a pixel, top row first: depth in world units, transmittance in [0,1], channel as its index in
/// the volume, cost in fetches per sample. NaN where the variable is not defined: depth and channel of a
/// pixel none of whose rays met anything, all of a film without samples.
struct AovValues {
  Aov aov = Aov::depth;
  int width = 0, height = 0;
  std::vector<float> values;
};

/// For float files: the value as grey and alpha 1; all 0 where it is not defined.
Image aovImage(const AovValues& aov);
/// To look at: depth white (nearest) to dark grey (farthest), transmittance as grey, channels in the default
/// colours of a volume, cost in the colours of inferno from 0 to the largest; black where it is not defined.
Image aovPicture(const AovValues& aov);

/// Sums over the samples of a film: what its rays met first.
class FirstCollisions {
 public:
  /// `channels`: of the volume.
  void reset(std::size_t pixels, std::size_t channels);
  /// Of memory, for each pixel.
  static std::size_t pixelBytes(std::size_t channels) {
    return sizeof(kernel::FirstCollision) + sizeof(double) + channels * sizeof(std::uint32_t);
  }
  /// Where a launcher puts one pass; committed by add(), otherwise lost.
  kernel::FirstCollision* pass() { return pass_.data(); }
  /// `volumeChannels`: of the visible ones, as a pass counts them.
  void add(std::span<const int> volumeChannels);
  std::vector<float> depth() const;
  std::vector<float> channel() const;

 private:
  std::size_t channels_ = 0;
  std::vector<kernel::FirstCollision> pass_;
  std::vector<double> depthSum_;
  std::vector<std::uint32_t> hits_;  // pixels x channels
};

}  // namespace scolopax
