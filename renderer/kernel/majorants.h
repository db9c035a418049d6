// SPDX-License-Identifier: Apache-2.0
// Upper bounds of the extinction (majorants) per macrocell. data/majorant_grid builds them; their layout is
// defined only here.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "renderer/kernel/portable.h"

namespace scolopax::kernel {

/// Maximum number of levels into which the values of a channel in macrocells are quantised.
inline constexpr int kMaxLevels = 256;

/// Range of a channel's samples in a macrocell: from level lo to level hi, lo <= hi. Levels quantise stored
/// values or, where the extinction depends on more than the stored value, the extinction itself.
struct LevelInterval {
  std::uint8_t lo, hi;
};

/// Sparse table that gives the largest extinction of one channel over an interval of its levels in constant
/// time.
struct BoundTable {
  /// [0][i]: at level i; [1 + k][i]: over the 2^k gaps between neighbouring levels that begin at level i
  float largest[9][kMaxLevels];
  int column;  ///< index of the channel's interval among the intervals of a cell

  SCOLOPAX_HD float over(LevelInterval values) const {
    const int gaps = values.hi - values.lo;
    // The exponent of float(2 * gaps + 1) is the bit width of gaps, 0 for no gaps.
    const int row = int(std::bit_cast<std::uint32_t>(float(2 * gaps + 1)) >> 23) - 127;
    const int span = (1 << row) >> 1;  // the largest power of two <= gaps; 0 for no gaps
    const float a = largest[row][values.lo], b = largest[row][values.hi - span];
    return a > b ? a : b;
  }
};

/// Macrocells per edge of a block. A walk skips empty blocks as a whole.
inline constexpr int kBlockEdge = 4;
inline constexpr int kMaxEmptyRadius = 8;

/// Combined bound of all visible channels in a macrocell: the upper 16 bits of a float, which is rounded up
/// by at most 1/128 of its value. If the sign bit is set, the bound is 0 and the remaining bits hold
/// emptyRadius().
using TotalCode = std::uint16_t;
inline constexpr TotalCode kEmptyCode = 0x8000;
SCOLOPAX_HD inline TotalCode codeOfTotal(float total) {
  return TotalCode((std::bit_cast<std::uint32_t>(total) + 0xffffu) >> 16);
}
SCOLOPAX_HD inline TotalCode codeOfEmpty(int radius) { return TotalCode(kEmptyCode | radius); }

/// Combined bound of visible channels over a cell's intervals: `sums` adds their bounds up, otherwise it is
/// the largest.
SCOLOPAX_HD inline float combinedBound(const BoundTable* tables, int count, bool sums,
                                       const LevelInterval* intervals) {
  float total = 0.0f;
  for (int n = 0; n < count; ++n) {
    const float bound = tables[n].over(intervals[tables[n].column]);
    total = sums ? total + bound : (bound > total ? bound : total);
  }
  return total;
}

/// Bit n is set if the bound of visible channel n over a cell's intervals is above 0.
SCOLOPAX_HD inline std::uint32_t activeChannels(const BoundTable* tables, int count,
                                                const LevelInterval* intervals) {
  std::uint32_t active = 0;
  for (int n = 0; n < count; ++n)
    if (tables[n].over(intervals[tables[n].column]) > 0.0f) active |= 1u << n;
  return active;
}

/// Cell (i,j,k) has index (k * cells.y + j) * cells.x + i and covers voxel coordinates [i, i+1] * cellSize on
/// the x axis, and likewise on the others. The outer cells extend to the faces of the box.
struct MajorantView {
  glm::ivec3 cells;
  float cellSize;
  const TotalCode* totals;         ///< per cell
  const LevelInterval* intervals;  ///< `columns` intervals per cell
  int columns;
  const BoundTable* tables;  ///< per visible channel
  int tableCount;
  bool sums;                  ///< as for combinedBound()
  const std::uint8_t* radii;  ///< per block, x fastest: emptyRadius() of its cells; for devices
  /// Cells (i,j,k) outside [filledLow, filledHigh) are empty. The range consists of whole blocks.
  glm::ivec3 filledLow, filledHigh;
  /// Per cell: bit n is set if the bound of visible channel n is above 0. For packets of rays, which look up
  /// several cells at once; null where they do not need it (PointSegments::meetsSomething).
  const std::uint32_t* active;

  /// Combined bound of all visible channels: of the sum of their extinctions or, for blend modes in which the
  /// largest extinction hides the others, of the largest. Never below the sum (or maximum) of the channels'
  /// own bounds.
  SCOLOPAX_HD float total(std::size_t cell) const {
    return totals[cell] < kEmptyCode ? std::bit_cast<float>(std::uint32_t(totals[cell]) << 16) : 0.0f;
  }
  SCOLOPAX_HD const LevelInterval* intervalsOf(std::size_t cell) const {
    return &intervals[cell * std::size_t(columns)];
  }
  /// Code of a cell, for a launcher that computes the totals itself.
  SCOLOPAX_HD TotalCode codeOf(std::size_t cell, int radius) const {
    return radius > 0 ? codeOfEmpty(radius)
                      : codeOfTotal(combinedBound(tables, tableCount, sums, intervalsOf(cell)));
  }
  /// Largest r such that all blocks less than r blocks away from the cell's block, along every axis, are
  /// empty; at most kMaxEmptyRadius. 0 for a cell that is not empty.
  SCOLOPAX_HD int emptyRadius(std::size_t cell) const {
    return totals[cell] < kEmptyCode ? 0 : totals[cell] - kEmptyCode;
  }
  /// Bound of visible channel n.
  SCOLOPAX_HD float bound(std::size_t cell, int n) const {
    return tables[n].over(intervalsOf(cell)[tables[n].column]);
  }
};

}  // namespace scolopax::kernel
