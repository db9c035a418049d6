// SPDX-License-Identifier: Apache-2.0
// Arbitrary output variables (AOVs): what is known of a pixel besides its colour. A launcher fills passes, as
// it does for the film; files and responses take the values.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/data/image.h"
#include "renderer/data/method.h"
#include "renderer/kernel/sample_records.h"

namespace scolopax {

/// The AOV with this name; nullopt if there is none.
std::optional<Aov> aovOf(std::string_view name);
/// All names, for messages: "depth, transmittance, ...".
std::string aovNames();

/// One value per pixel, top row first: depth in world units, transmittance in [0,1], channel as an index in
/// the volume, cost in fetches per sample. NaN where the variable is undefined: depth and channel of a pixel
/// whose rays had no collision, and every value of a film without samples.
struct AovValues {
  Aov aov = Aov::depth;
  int width = 0, height = 0;
  std::vector<float> values;
};

/// For float files: the value as grey with alpha 1; all components 0 where it is undefined.
Image aovImage(const AovValues& aov);
/// For viewing: depth from white (nearest) to dark grey (farthest), transmittance as grey, channels in the
/// default colours of a volume, cost in the inferno colour map from 0 to the largest value; black where the
/// variable is undefined.
Image aovPicture(const AovValues& aov);

/// First collisions of rays, summed over the samples of a film.
class FirstCollisions {
 public:
  /// `channels`: number of channels of the volume.
  void reset(std::size_t pixels, std::size_t channels);
  /// Bytes of memory per pixel.
  static std::size_t pixelBytes(std::size_t channels) {
    return sizeof(kernel::FirstCollision) + sizeof(double) + channels * sizeof(std::uint32_t);
  }
  /// Buffer that a launcher fills with one pass; add() commits it, otherwise it is lost.
  kernel::FirstCollision* pass() { return pass_.data(); }
  /// Commits the pass. `volumeChannels`: for each visible channel, as a pass numbers them, its index in the
  /// volume.
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
