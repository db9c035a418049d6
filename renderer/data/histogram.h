// SPDX-License-Identifier: Apache-2.0
// Distribution of a channel's data values: for the page's plot, and for default ranges and densities.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace scolopax {

struct Histogram {
  double minimum = 0, maximum = 0;  ///< of the finite values; both 0 when there is none
  std::uint64_t finiteCount = 0;
  std::uint64_t nonFiniteCount = 0;  ///< NaN and infinities
  std::vector<std::uint64_t> bins;   ///< equal widths over [minimum, maximum]; 256 of them
  std::vector<double> quantiles;     ///< at i / (size - 1), from a fixed subset of at most 2^20 voxels

  /// Data value below which the fraction p in [0,1] of the voxels lies, by linear interpolation.
  double quantile(double p) const;
};

class VoxelBuffer;
/// Measures voxels, as data values slope * stored + intercept.
Histogram measureHistogram(const VoxelBuffer& voxels, double slope, double intercept);

}  // namespace scolopax
