// SPDX-License-Identifier: Apache-2.0
// Per macrocell and channel: the interval of stored values that any sample inside can take. Made from a
// Volume once; majorant_grid and the kernels read it.
#pragma once
#include <memory>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/kernel/majorants.h"

namespace scolopax {

/// Stored values; lo > hi where no sample of the cell is finite.
struct ValueInterval {
  float lo, hi;
};

/// The stored values of a channel that intervals may begin and end at.
struct ValueLevels {
  /// Increasing, at most kernel::kMaxLevels; NaN as the last stands for cells without a finite sample.
  std::vector<float> values;
  /// How far rounding in kernel/sample_volume.h may bring a sample beyond the ends of an interval. An
  /// interval of one value, and an end at 0, are exact. 0 where the levels already allow for it.
  float slack = 0;

  /// The stored values of an interval of levels.
  ValueInterval decode(kernel::LevelInterval interval) const;
};

struct MacrocellGrid {
  int size = 0;                     ///< voxels per edge
  glm::ivec3 cells{0};              ///< per axis; cell (i,j,k) covers voxel coordinates [i, i+1] * size
  std::vector<ValueLevels> levels;  ///< per channel of the volume
  std::vector<kernel::LevelInterval> intervals;  ///< per cell, x fastest, those of all channels

  std::size_t cellCount() const { return std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z); }
  ValueInterval interval(std::size_t cell, std::size_t channel) const {
    return levels[channel].decode(intervals[cell * levels.size() + channel]);
  }
};

/// Measures all channels. An interval covers the voxels whose interpolation reaches into the cell, from the
/// last level at or below the least of them to the first at or above the largest. Every value is a level
/// where a channel's intervals have no more than kMaxLevels ends; else one half of the levels divides the
/// range evenly, so that no interval grows by more than 1/127 of it at an end, and the other half follows the
/// values' density.
MacrocellGrid buildMacrocells(const Volume& volume, int size);

/// The same, shared among everybody who asks for this volume and size while somebody holds it.
std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size);

}  // namespace scolopax
