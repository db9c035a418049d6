// SPDX-License-Identifier: Apache-2.0
// The table of peaks of Knoll et al. 2009, section 4.1: which peaks of the opacity curve a segment may cross.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "renderer/data/surfaces.h"
#include "renderer/kernel/classify.h"

namespace scolopax::peaks {

/// A peak of the opacity curve, drawn as a surface.
struct PeakSurface {
  float position;
  float opacity;  ///< 1 - exp(-extinction), with the paper's constant step of 1, of the smallest spacing
  glm::vec3 color;
};

inline std::vector<PeakSurface> surfacesAtPeaks(const std::vector<OpacityKnot>& curve,
                                                const kernel::ChannelView& channel, double smallestSpacing) {
  std::vector<PeakSurface> surfaces;
  for (const Peak& peak : peaksOf(curve)) {
    const auto position = float(peak.position);
    surfaces.push_back({position, float(-std::expm1(-peak.value * double(channel.density) * smallestSpacing)),
                        kernel::evaluate(channel.color, position)});
  }
  return surfaces;
}

/// For every pair of bins of the values at the front and the back of a segment, the first peaks in the order
/// in which the segment crosses them.
class PeakTable {
 public:
  static constexpr int kBins = 128, kMost = 4;

  /// `most`: of the peaks of one segment, at most kMost. The paper does not say to which bin a peak at a
  /// bin's edge or inside one belongs. Here the peaks in the bins of both ends are included: peaks that are
  /// not crossed fail the rule of signs, and rounding to bins loses none that is crossed.
  PeakTable(std::vector<PeakSurface> surfaces, int most)
      : surfaces_(std::move(surfaces)), entries_(std::size_t(kBins) * kBins) {
    for (int front = 0; front < kBins; ++front)
      for (int back = 0; back < kBins; ++back) {
        Entry& entry = entries_[std::size_t(front * kBins + back)];
        const int count = int(surfaces_.size());
        for (int i = 0; i < count && entry.count < most; ++i) {
          const int peak = front <= back ? i : count - 1 - i;
          const int bin = binOf(surfaces_[std::size_t(peak)].position);
          if (bin >= std::min(front, back) && bin <= std::max(front, back))
            entry.peaks[std::size_t(entry.count++)] = std::uint8_t(peak);
        }
      }
  }

  /// Calls visit(surface) for the peaks of a segment, in order. Returns whether there are any.
  template <class Visit>
  bool visit(float front, float back, Visit&& visit) const {
    const int f = binOf(front), b = binOf(back);
    const Entry& entry = entries_[std::size_t(f * kBins + b)];
    const bool falls = f == b && back < front;  // the entry of a pair of equal bins is in ascending order
    for (int i = 0; i < entry.count; ++i)
      visit(surfaces_[entry.peaks[std::size_t(falls ? entry.count - 1 - i : i)]]);
    return entry.count > 0;
  }

 private:
  struct Entry {
    int count = 0;
    std::array<std::uint8_t, kMost> peaks{};
  };
  static int binOf(float position) {
    return kernel::clampInt(int(kernel::clamp(position, 0.0f, 1.0f) * float(kBins)), 0, kBins - 1);
  }
  std::vector<PeakSurface> surfaces_;  // ascending
  std::vector<Entry> entries_;
};

}  // namespace scolopax::peaks
