// SPDX-License-Identifier: Apache-2.0
// Distribution of a channel's data values: for the page's plot, and for default ranges and densities.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace scolopax {

struct Histogram {
  static constexpr std::size_t kBins = 256;

  double minimum = 0, maximum = 0;  ///< of the finite values; both 0 when there is none
  std::uint64_t finiteCount = 0;
  std::uint64_t nonFiniteCount = 0;  ///< NaN and infinities
  std::vector<std::uint64_t> bins;   ///< kBins, of equal widths over [minimum, maximum]
  /// At i / (size - 1). Exact for integer voxels; from a fixed subset of fewer than 2^21 for float voxels.
  std::vector<double> quantiles;

  /// The bin of a finite value.
  std::size_t binOf(double value) const {
    // Halved first: the difference of two huge values would overflow.
    const double width = 0.5 * maximum - 0.5 * minimum;
    if (!(width > 0)) return 0;
    const double at = (0.5 * value - 0.5 * minimum) / width * double(kBins);
    return std::min(std::size_t(std::max(at, 0.0)), kBins - 1);
  }
  /// Data value below which a fraction p in [0,1] of the finite voxels lies, by linear interpolation; 0 if
  /// there are none.
  double quantile(double p) const;
};

class VoxelBuffer;
/// Measures the voxels' data values, slope * stored + intercept.
Histogram measureHistogram(const VoxelBuffer& voxels, double slope, double intercept);

}  // namespace scolopax
