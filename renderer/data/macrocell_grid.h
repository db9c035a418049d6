// SPDX-License-Identifier: Apache-2.0
// Per macrocell and channel: the interval of stored values that any sample inside can take. Made from a
// Volume once; majorant_grid and the kernels read it.
#pragma once
#include <glm/common.hpp>
#include <stop_token>
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

/// The blocks of kernel::kBlockEdge cells on an edge that a grid of cells is divided into.
struct CellBlocks {
  glm::ivec3 cells, size;  ///< per axis: cells of the grid, and blocks
  explicit CellBlocks(glm::ivec3 cellsOfGrid)
      : cells(cellsOfGrid), size((cellsOfGrid + (kernel::kBlockEdge - 1)) / kernel::kBlockEdge) {}
  std::size_t count() const { return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z); }
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
  std::vector<kernel::LevelInterval> intervals;  ///< per cell, x fastest, those of all channels
  std::vector<kernel::LevelInterval> blocks;     ///< the same of blocks of cells (CellBlocks): what is in any

  std::size_t cellCount() const { return std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z); }
  std::size_t sizeBytes() const { return (intervals.size() + blocks.size()) * sizeof(kernel::LevelInterval); }
  ValueInterval interval(std::size_t cell, std::size_t channel) const {
    return levels[channel].decode(intervals[cell * levels.size() + channel]);
  }
};

/// How many macrocells of `size` voxels on an edge there are per axis. They lie between voxel centres: their
/// support is size + 1 voxels an edge.
glm::ivec3 macrocellsOf(glm::ivec3 dims, int size);

/// Measures all channels. An interval covers the voxels whose interpolation reaches into the cell, from the
/// last level at or below the least of them to the first at or above the largest. Every value is a level
/// where a channel's intervals have no more than kMaxLevels ends; else one half of the levels divides the
/// range evenly, so that no interval grows by more than 1/127 of it at an end, and the other half follows the
/// values' density.
/// Throws Error(cancelled) once `stop` is requested.
MacrocellGrid buildMacrocells(const Volume& volume, int size, const std::stop_token& stop = {});

/// Intervals of all channels in a grid of this size.
std::size_t intervalCount(const Volume& volume, int size);

}  // namespace scolopax
