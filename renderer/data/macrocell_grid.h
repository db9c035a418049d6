// SPDX-License-Identifier: Apache-2.0
// Per macrocell and channel: an interval that contains the stored value of every sample inside. Built once
// from a Volume; majorant_grid and the kernels read it.
#pragma once
#include <glm/common.hpp>
#include <stop_token>
#include <vector>

#include "renderer/data/volume.h"
#include "renderer/kernel/majorants.h"

namespace scolopax {

/// An interval of stored values; lo > hi if no sample of the cell is finite.
struct ValueInterval {
  float lo, hi;
};

/// The stored values of a channel at which intervals may begin and end.
struct ValueLevels {
  /// Increasing, at most kernel::kMaxLevels. If the last one is NaN, it stands for cells without a finite
  /// sample.
  std::vector<float> values;
  /// How far rounding in kernel/sample_volume.h may carry a sample beyond an end of its interval; 0 if the
  /// levels already allow for it. An interval of one value, and an end at 0, are exact.
  float slack = 0;

  /// The stored values of an interval of levels.
  ValueInterval decode(kernel::LevelInterval interval) const;
};

/// One interval per macrocell.
struct CellColumn {
  ValueLevels levels;
  std::vector<kernel::LevelInterval> cells;  ///< x fastest
  std::size_t sizeBytes() const { return cells.size() * sizeof(kernel::LevelInterval); }
};

/// Divides a grid of cells into blocks with edges of kernel::kBlockEdge cells.
struct CellBlocks {
  glm::ivec3 cells, size;  ///< per axis: number of cells, and of blocks
  explicit CellBlocks(glm::ivec3 cellsOfGrid)
      : cells(cellsOfGrid), size((cellsOfGrid + (kernel::kBlockEdge - 1)) / kernel::kBlockEdge) {}
  std::size_t count() const { return countOf(size); }
  /// Calls f(cell) for the cells of a block.
  template <class F>
  void visitCells(std::size_t block, F&& f) const {
    const std::size_t x = std::size_t(size.x), y = std::size_t(size.y);
    const glm::ivec3 first =
        glm::ivec3(int(block % x), int(block / x % y), int(block / x / y)) * kernel::kBlockEdge;
    const glm::ivec3 end = glm::min(first + kernel::kBlockEdge, cells);
    for (int k = first.z; k < end.z; ++k)
      for (int j = first.y; j < end.y; ++j) {
        const std::size_t row =
            (std::size_t(k) * std::size_t(cells.y) + std::size_t(j)) * std::size_t(cells.x);
        for (int i = first.x; i < end.x; ++i) f(row + std::size_t(i));
      }
  }
};

struct MacrocellGrid {
  int size = 0;                     ///< voxels per edge
  glm::ivec3 cells{0};              ///< per axis; cell (i,j,k) covers voxel coordinates [i, i+1] * size
  std::vector<ValueLevels> levels;  ///< per channel of the volume
  std::vector<kernel::LevelInterval> intervals;  ///< per cell, x fastest: one per channel
  std::vector<kernel::LevelInterval> blocks;     ///< per block (CellBlocks): the union over its cells

  std::size_t cellCount() const { return countOf(cells); }
  std::size_t sizeBytes() const { return (intervals.size() + blocks.size()) * sizeof(kernel::LevelInterval); }
  ValueInterval interval(std::size_t cell, std::size_t channel) const {
    return levels[channel].decode(intervals[cell * levels.size() + channel]);
  }
};

/// Number of macrocells, with edges of `size` voxels, along each axis. They lie between voxel centres, so
/// that the support of one is size + 1 voxels per edge.
glm::ivec3 macrocellsOf(glm::ivec3 dims, int size);

/// Measures all channels. The interval of a cell covers the voxels that interpolation inside the cell reads,
/// from the last level at or below the least of them to the first at or above the largest. If the intervals
/// of a channel have at most kMaxLevels different ends, each of them is a level. Otherwise one half of the
/// levels divides the range evenly, so that no interval grows at either end by more than 1/127 of the range,
/// and the other half follows the density of the ends.
/// Throws Error(cancelled) once `stop` is requested.
MacrocellGrid buildMacrocells(const Volume& volume, int size, const std::stop_token& stop = {});

/// The same for one channel whose samples are those of the cubic B-spline, which reads the voxels around a
/// cell, too.
CellColumn buildSplineColumn(const Volume& volume, int channel, int size, const std::stop_token& stop = {});

/// Number of intervals, over all cells and channels, of a volume with these dims in cells of this size.
std::size_t intervalCount(glm::ivec3 dims, std::size_t channels, int size);

}  // namespace scolopax
