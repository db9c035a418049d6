// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/majorant_grid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>

#include "renderer/data/measuring.h"

namespace scolopax {
namespace {

using kernel::BoundTable;
using kernel::kMaxLevels;
using kernel::LevelInterval;
using kernel::TotalCode;

constexpr std::size_t kBlocksAtOnce = 256;

/// In: 0 for blocks that are not empty, kMaxEmptyRadius for the others. Out: the distance of each block to
/// the nearest that is not empty, at most kMaxEmptyRadius. The distance is the largest along any axis, so it
/// is found axis by axis.
void measureRadii(glm::ivec3 size, std::vector<std::uint8_t>& radii, std::vector<std::uint8_t>& scratch) {
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t length = std::size_t(size[axis]);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, radii.size(), 1024), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        const std::size_t at = i / stride % length;
        int nearest = radii[i];
        for (int away = 1; away < nearest; ++away) {
          const auto step = std::size_t(away);
          if (at >= step) nearest = std::min(nearest, std::max(away, int(radii[i - step * stride])));
          if (at + step < length) nearest = std::min(nearest, std::max(away, int(radii[i + step * stride])));
        }
        scratch[i] = std::uint8_t(nearest);
      }
    });
    radii.swap(scratch);
    stride *= length;
  }
}

/// `over` must bound a single level, and two neighbouring levels with everything between them.
template <class Over>
BoundTable tableOfLevels(const ValueLevels& levels, int column, Over&& over) {
  BoundTable table{};
  table.column = column;
  const int count = int(levels.values.size());
  for (int i = 0; i < count; ++i) {
    const auto level = std::uint8_t(i), next = std::uint8_t(i + 1);
    table.largest[0][i] = over(LevelInterval{level, level});
    if (i + 1 < count) table.largest[1][i] = over(LevelInterval{level, next});
  }
  for (int row = 2; row < 9; ++row)
    for (int i = 0, half = 1 << (row - 2); i + 2 * half < count; ++i)
      table.largest[row][i] = std::max(table.largest[row - 1][i], table.largest[row - 1][i + half]);
  return table;
}

const BoundTable* tableOf(const std::vector<BoundTable>& tables, int column) {
  const auto found =
      std::find_if(tables.begin(), tables.end(), [&](const BoundTable& t) { return t.column == column; });
  return found == tables.end() ? nullptr : &*found;
}

}  // namespace

BoundTable buildBounds(const ValueLevels& levels, const TransferFunction& transfer, int column) {
  return tableOfLevels(levels, column, [&](kernel::LevelInterval interval) {
    return transfer.majorant(levels.decode(interval));
  });
}

BoundTable buildPresence(const ValueLevels& levels, const Surfaces& surfaces, int column) {
  // The last level may be NaN.
  const std::vector<float>& values = levels.values;
  const float last =
      std::isnan(values.back()) && values.size() > 1 ? values[values.size() - 2] : values.back();
  const float range = last - values.front();
  return tableOfLevels(levels, column, [&](kernel::LevelInterval interval) {
    return surfaces.presence(levels.decode(interval), std::isfinite(range) ? range : 0.0f);
  });
}

BoundTable boundsOfExtinction(const ValueLevels& levels, int column) {
  return tableOfLevels(levels, column,
                       [&](kernel::LevelInterval interval) { return levels.values[interval.hi]; });
}

/// What is computed per macrocell.
struct MajorantGrid::Totals {
  std::vector<TotalCode> codes;       ///< per cell, and two more: gathers read them in pairs
  std::vector<std::uint8_t> radii;    ///< per block
  std::vector<std::uint32_t> active;  ///< per cell: bits of its active channels; empty unless apart
  glm::ivec3 filledLow{0}, filledHigh{0};

  Totals(std::size_t cells, std::size_t blocks, bool apart)
      : codes(cells + 2), radii(blocks), active(apart ? cells : 0) {}
  static std::size_t sizeBytes(std::size_t cells, std::size_t blocks, bool apart) {
    return cells * (sizeof(TotalCode) + (apart ? sizeof(std::uint32_t) : 0)) + blocks;
  }
  void measureFilled(glm::ivec3 blocks, glm::ivec3 cells);
};

/// Which totals an edit changes.
struct MajorantGrid::Changes {
  /// The intervals of one channel over which two tables may differ: those that reach level `first` and begin
  /// no later than level `last`.
  struct Change {
    int column, first, last;
    bool meets(LevelInterval v) const { return v.hi >= first && v.lo <= last; }
  };
  bool all;
  std::vector<Change> some;

  /// Appends the range of levels in which the tables differ; null is the table of a channel that is not
  /// visible.
  void add(const BoundTable* before, const BoundTable* after) {
    // Levels and gaps alternate: 2i is level i, 2i + 1 the gap above it.
    int first = 2 * kMaxLevels, last = -1;
    for (int i = 0; i < 2 * kMaxLevels; ++i) {
      const float a = before ? before->largest[i % 2][i / 2] : 0.0f,
                  b = after ? after->largest[i % 2][i / 2] : 0.0f;
      if (a == b) continue;
      first = std::min(first, i);
      last = i;
    }
    if (last >= 0) some.push_back({(before ? before : after)->column, (first + 1) / 2, last / 2});
  }
  bool meet(const LevelInterval* intervals) const {
    return all || std::any_of(some.begin(), some.end(),
                              [&](const Change& change) { return change.meets(intervals[change.column]); });
  }
};

MajorantGrid::MajorantGrid(std::shared_ptr<const MacrocellGrid> macrocells, std::vector<BoundTable> tables,
                           bool sums, bool apart, const MajorantGrid* before,
                           const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop)
    : macrocells_(std::move(macrocells)),
      tables_(std::make_shared<const std::vector<BoundTable>>(std::move(tables))),
      sums_(sums) {
  apart = apart || macrocells_->levels.size() > kFewColumns;
  const Changes changes = before ? changesSince(*before, apart) : Changes{true, {}};
  // Channels without any extinction may have come or gone: that changes no total.
  if (!changes.all && changes.some.empty()) {
    totals_ = before->totals_;
    return;
  }
  const std::size_t cells = macrocells_->cellCount(), blocks = CellBlocks(macrocells_->cells).count();
  auto share = MemoryBudget::take(memory, MemoryUse::grids, Totals::sizeBytes(cells, blocks, apart));
  Totals totals = changes.all ? Totals(cells, blocks, apart) : *before->totals_;
  cellsRebuilt_ = rebuild(changes, totals, stop);
  totals_ = withShare(std::move(share), std::move(totals));
}

MajorantGrid::Changes MajorantGrid::changesSince(const MajorantGrid& before, bool apart) const {
  const std::vector<BoundTable>&now = *tables_, &then = *before.tables_;
  // Bits number the visible channels: if other channels are visible than before, every cell changes.
  const bool renumbered =
      apart && !std::equal(now.begin(), now.end(), then.begin(), then.end(),
                           [](const BoundTable& a, const BoundTable& b) { return a.column == b.column; });
  if (macrocells_ != before.macrocells_ || renumbered || sums_ != before.sums_ ||
      apart == before.totals_->active.empty())
    return {true, {}};
  Changes changes{false, {}};
  for (int column = 0; column < int(macrocells_->levels.size()); ++column)
    changes.add(tableOf(then, column), tableOf(now, column));
  return changes;
}

/// Updates the totals; returns the number of cells that were recomputed.
std::size_t MajorantGrid::rebuild(const Changes& changes, Totals& totals, const std::stop_token& stop) const {
  const CellBlocks blocks(macrocells_->cells);
  const std::size_t columns = macrocells_->levels.size();
  std::vector<std::uint8_t> radii(blocks.count()), scratch(blocks.count()), stale(blocks.count());
  std::atomic<std::size_t> touched = 0;
  std::atomic<bool> other = changes.all;  // whether the set of empty blocks changes
  // Blocks first: most of them contain no value that an edit changes.
  forEachOf(blocks.count(), kBlocksAtOnce, stop, [&](std::size_t block) {
    radii[block] = totals.radii[block] > 0 ? kernel::kMaxEmptyRadius : 0;
    if (!changes.meet(&macrocells_->blocks[block * columns])) return;
    std::size_t count = 0;
    bool empty = true;
    blocks.visitCells(block, [&](std::size_t cell) {
      const LevelInterval* intervals = &macrocells_->intervals[cell * columns];
      if (changes.meet(intervals)) {
        totals.codes[cell] = kernel::codeOfTotal(totalOf(intervals));
        if (!totals.active.empty()) totals.active[cell] = activeOf(intervals);
        ++count;
      }
      empty = empty && (totals.codes[cell] == 0 || totals.codes[cell] >= kernel::codeOfEmpty(0));
    });
    radii[block] = empty ? kernel::kMaxEmptyRadius : 0;
    stale[block] = count > 0;
    if (count > 0) touched += count;
    if (empty != (totals.radii[block] > 0)) other = true;
  });

  if (other)
    measureRadii(blocks.size, radii, scratch);
  else
    radii = totals.radii;
  forEachOf(blocks.count(), kBlocksAtOnce, stop, [&](std::size_t block) {
    if (radii[block] == totals.radii[block] && !(stale[block] && radii[block] > 0)) return;
    blocks.visitCells(block, [&](std::size_t cell) {
      if (radii[block] > 0)
        totals.codes[cell] = kernel::codeOfEmpty(radii[block]);
      else if (totals.codes[cell] >= kernel::codeOfEmpty(0))
        totals.codes[cell] = 0;
    });
  });
  totals.radii = std::move(radii);
  if (other) totals.measureFilled(blocks.size, macrocells_->cells);
  return touched;
}

void MajorantGrid::Totals::measureFilled(glm::ivec3 blocks, glm::ivec3 cells) {
  glm::ivec3 low = blocks, high(0);
  std::size_t i = 0;
  for (int z = 0; z < blocks.z; ++z)
    for (int y = 0; y < blocks.y; ++y)
      for (int x = 0; x < blocks.x; ++x)
        if (radii[i++] == 0) {
          low = glm::min(low, glm::ivec3(x, y, z));
          high = glm::max(high, glm::ivec3(x, y, z) + 1);
        }
  filledLow = low * kernel::kBlockEdge;
  filledHigh = glm::min(high * kernel::kBlockEdge, cells);
}

float MajorantGrid::totalOf(const LevelInterval* intervals) const {
  return kernel::combinedBound(tables_->data(), int(tables_->size()), sums_, intervals);
}

std::uint32_t MajorantGrid::activeOf(const LevelInterval* intervals) const {
  return kernel::activeChannels(tables_->data(), int(tables_->size()), intervals);
}

kernel::MajorantView MajorantGrid::view() const {
  return {macrocells_->cells,
          float(macrocells_->size),
          totals_->codes.data(),
          macrocells_->intervals.data(),
          int(macrocells_->levels.size()),
          tables_->data(),
          int(tables_->size()),
          sums_,
          totals_->radii.data(),
          totals_->filledLow,
          totals_->filledHigh,
          totals_->active.empty() ? nullptr : totals_->active.data()};
}

}  // namespace scolopax
