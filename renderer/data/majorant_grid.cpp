// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/majorant_grid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <glm/common.hpp>

namespace scolopax {
namespace {

using kernel::BoundTable;
using kernel::kMaxLevels;
using kernel::LevelInterval;
using kernel::TotalCode;

/// The intervals of one channel over which two tables may differ: those that reach `first` and begin no later
/// than `last`.
struct Change {
  int column, first, last;
  bool meets(LevelInterval v) const { return v.hi >= first && v.lo <= last; }
};

/// Adds where the tables differ; null: nothing can be seen of the channel.
void addChange(const BoundTable* before, const BoundTable* after, std::vector<Change>& changes) {
  // Levels and the gaps between them in turn: 2i is level i, 2i + 1 the gap above it.
  int first = 2 * kMaxLevels, last = -1;
  for (int i = 0; i < 2 * kMaxLevels; ++i) {
    const float a = before ? before->largest[i % 2][i / 2] : 0.0f,
                b = after ? after->largest[i % 2][i / 2] : 0.0f;
    if (a == b) continue;
    first = std::min(first, i);
    last = i;
  }
  if (last >= 0) changes.push_back({(before ? before : after)->column, (first + 1) / 2, last / 2});
}

/// Calls f(block) for all, from many threads.
template <class F>
void forBlocks(const CellBlocks& blocks, F&& f) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.count(), 256), [&](const auto& range) {
    for (std::size_t block = range.begin(); block < range.end(); ++block) f(block);
  });
}

/// From 0 for blocks that are not empty, and kMaxEmptyRadius for the others, to the distance of each to the
/// nearest that is not empty: the largest of the distances along the axes, and so found axis by axis.
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

/// `over` bounds a level, and two neighbouring levels and all between them.
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

BoundTable boundsOfExtinction(const ValueLevels& levels, int column) {
  return tableOfLevels(levels, column,
                       [&](kernel::LevelInterval interval) { return levels.values[interval.hi]; });
}

std::size_t MajorantGrid::sizeBytes(const MacrocellGrid& macrocells) {
  return macrocells.cellCount() * (sizeof(TotalCode) + sizeof(std::uint32_t)) +
         CellBlocks(macrocells.cells).count();
}

std::size_t MajorantGrid::update(std::shared_ptr<const MacrocellGrid> macrocells,
                                 std::vector<BoundTable> tables, bool sums, bool apart) {
  apart = apart || macrocells->levels.size() > kFewColumns;
  const bool newCells = macrocells != macrocells_;
  // Bits of channels count visible ones: where others are visible than before, all change.
  const bool renumbered =
      apart && !std::equal(tables.begin(), tables.end(), tables_.begin(), tables_.end(),
                           [](const BoundTable& a, const BoundTable& b) { return a.column == b.column; });
  const bool all = newCells || renumbered || sums != sums_ || apart == active_.empty();
  const CellBlocks blocks(macrocells->cells);
  std::vector<Change> changes;
  for (int column = 0; column < int(macrocells->levels.size()); ++column)
    addChange(tableOf(tables_, column), tableOf(tables, column), changes);
  if (!all && changes.empty()) {  // perhaps there are channels more or less that have no extinction anywhere
    tables_ = std::move(tables);
    return 0;
  }
  std::vector<std::uint8_t> radii(blocks.count()), scratch(blocks.count()), stale(blocks.count());
  std::vector<std::uint32_t> active(all && apart ? macrocells->cellCount() : 0);
  if (newCells) {
    std::vector<std::uint8_t> noRadii(blocks.count());
    std::vector<TotalCode> totals(macrocells->cellCount() + 2);  // processors gather pairs of them
    totals_ = std::move(totals);
    radii_ = std::move(noRadii);
  }
  if (all) active_ = std::move(active);
  macrocells_ = std::move(macrocells);
  tables_ = std::move(tables);
  sums_ = sums;

  const std::size_t columns = macrocells_->levels.size();
  std::atomic<std::size_t> touched = 0;
  std::atomic<bool> other = false;  // whether other blocks are empty than before
  const auto meets = [&](const LevelInterval* intervals) {
    return all || std::any_of(changes.begin(), changes.end(),
                              [&](const Change& change) { return change.meets(intervals[change.column]); });
  };
  // Blocks first: most of them have none of the values that an edit changes.
  forBlocks(blocks, [&](std::size_t block) {
    radii[block] = radii_[block] > 0 ? kernel::kMaxEmptyRadius : 0;
    if (!meets(&macrocells_->blocks[block * columns])) return;
    std::size_t count = 0;
    bool empty = true;
    blocks.visitCells(block, [&](std::size_t cell) {
      const LevelInterval* intervals = &macrocells_->intervals[cell * columns];
      if (meets(intervals)) {
        totals_[cell] = kernel::codeOfTotal(totalOf(intervals));
        if (!active_.empty()) active_[cell] = activeOf(intervals);
        ++count;
      }
      empty = empty && (totals_[cell] == 0 || totals_[cell] >= kernel::codeOfEmpty(0));
    });
    radii[block] = empty ? kernel::kMaxEmptyRadius : 0;
    stale[block] = count > 0;
    if (count > 0) touched += count;
    if (empty != (radii_[block] > 0)) other = true;
  });

  if (other)
    measureRadii(blocks.size, radii, scratch);
  else
    radii = radii_;
  forBlocks(blocks, [&](std::size_t block) {
    if (radii[block] == radii_[block] && !(stale[block] && radii[block] > 0)) return;
    blocks.visitCells(block, [&](std::size_t cell) {
      if (radii[block] > 0)
        totals_[cell] = kernel::codeOfEmpty(radii[block]);
      else if (totals_[cell] >= kernel::codeOfEmpty(0))
        totals_[cell] = 0;
    });
  });
  radii_ = std::move(radii);
  if (newCells || other) measureFilled(blocks.size);
  return touched;
}

void MajorantGrid::measureFilled(glm::ivec3 blocks) {
  glm::ivec3 low = blocks, high(0);
  std::size_t i = 0;
  for (int z = 0; z < blocks.z; ++z)
    for (int y = 0; y < blocks.y; ++y)
      for (int x = 0; x < blocks.x; ++x)
        if (radii_[i++] == 0) {
          low = glm::min(low, glm::ivec3(x, y, z));
          high = glm::max(high, glm::ivec3(x, y, z) + 1);
        }
  filledLow_ = low * kernel::kBlockEdge;
  filledHigh_ = glm::min(high * kernel::kBlockEdge, macrocells_->cells);
}

float MajorantGrid::totalOf(const LevelInterval* intervals) const {
  float total = 0.0f;
  for (const BoundTable& table : tables_) {
    const float bound = table.over(intervals[table.column]);
    total = sums_ ? total + bound : std::max(total, bound);
  }
  return total;
}

std::uint32_t MajorantGrid::activeOf(const LevelInterval* intervals) const {
  std::uint32_t active = 0;
  for (std::size_t n = 0; n < tables_.size(); ++n)
    if (tables_[n].over(intervals[tables_[n].column]) > 0.0f) active |= 1u << n;
  return active;
}

kernel::MajorantView MajorantGrid::view() const {
  return {macrocells_->cells,
          float(macrocells_->size),
          totals_.data(),
          macrocells_->intervals.data(),
          int(macrocells_->levels.size()),
          tables_.data(),
          filledLow_,
          filledHigh_,
          active_.empty() ? nullptr : active_.data()};
}

}  // namespace scolopax
