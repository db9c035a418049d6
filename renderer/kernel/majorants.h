// SPDX-License-Identifier: Apache-2.0
// Bounds of the extinction per macrocell, as data/majorant_grid keeps them: the only place that knows their
// layout.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "renderer/kernel/portable.h"

namespace scolopax::kernel {

/// Most levels that a channel's stored values are told apart by in macrocells.
inline constexpr int kMaxLevels = 256;

/// What a sample of one channel can be in a macrocell: from level lo to level hi of the channel's, lo <= hi.
/// Levels are of stored values or, where the extinction depends on more, of the extinction itself.
struct LevelInterval {
  std::uint8_t lo, hi;
};

/// Largest extinction of one channel over an interval of its levels, in constant time (a sparse table).
struct BoundTable {
  /// [0][i]: at level i alone; [1 + k][i]: over the 2^k gaps between neighbouring levels from level i on.
  float largest[9][kMaxLevels];
  int column;  ///< of the channel's intervals in a cell's

  SCOLOPAX_HD float over(LevelInterval values) const {
    const int gaps = values.hi - values.lo;
    // The exponent of 2 gaps + 1 is the number of bits of gaps, 0 for none.
    const int row = int(std::bit_cast<std::uint32_t>(float(2 * gaps + 1)) >> 23) - 127;
    const int span = (1 << row) >> 1;  // the largest power of two that is not above gaps
    const float a = largest[row][values.lo], b = largest[row][values.hi - span];
    return a > b ? a : b;
  }
};

/// Cells form blocks of this many on an edge, which a walk leaps over where they are empty.
inline constexpr int kBlockEdge = 4;
inline constexpr int kMaxEmptyRadius = 8;

/// Bound of all visible channels together in a cell: the upper half of a float, so that it is rounded up by
/// at most 1/128. With the sign bit, the bound is 0, and the rest is how far around nothing is (emptyRadius).
using TotalCode = std::uint16_t;
inline constexpr TotalCode kEmptyCode = 0x8000;
SCOLOPAX_HD inline TotalCode codeOfTotal(float total) {
  return TotalCode((std::bit_cast<std::uint32_t>(total) + 0xffffu) >> 16);
}
SCOLOPAX_HD inline TotalCode codeOfEmpty(int radius) { return TotalCode(kEmptyCode | radius); }

/// Cell (i,j,k), at cells' index (k * cells.y + j) * cells.x + i, covers voxel coordinates [i, i+1] *
/// cellSize; the outer cells reach to the faces of the box.
struct MajorantView {
  glm::ivec3 cells;
  float cellSize;
  const TotalCode* totals;         ///< per cell
  const LevelInterval* intervals;  ///< per cell: those of `columns` channels of the volume
  int columns;
  const BoundTable* tables;  ///< per visible channel
  /// All cells outside these are empty: from filledLow up to below filledHigh. Whole blocks.
  glm::ivec3 filledLow, filledHigh;
  /// Per cell: bit n: visible channel n has a bound above 0. For processors that want to know of several
  /// cells at once; null where the volume has few channels.
  const std::uint32_t* active;

  /// Bound of all visible channels together: of the sum of their extinctions, or, for blend modes that show
  /// one channel at a point, of the largest. Not below the sum (or maximum) of their bounds.
  SCOLOPAX_HD float total(std::size_t cell) const {
    return totals[cell] < kEmptyCode ? std::bit_cast<float>(std::uint32_t(totals[cell]) << 16) : 0.0f;
  }
  /// Greatest r such that the blocks that are less than r blocks away from the cell's, along every axis, are
  /// empty; at most kMaxEmptyRadius.
  SCOLOPAX_HD int emptyRadius(std::size_t cell) const {
    return totals[cell] < kEmptyCode ? 0 : totals[cell] - kEmptyCode;
  }
  /// Bound of visible channel n.
  SCOLOPAX_HD float bound(std::size_t cell, int n) const {
    return tables[n].over(intervals[cell * std::size_t(columns) + std::size_t(tables[n].column)]);
  }
};

}  // namespace scolopax::kernel
