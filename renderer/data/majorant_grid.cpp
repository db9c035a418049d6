// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/majorant_grid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

namespace scolopax {
namespace {

using kernel::BoundTable;
using kernel::kMaxLevels;
using kernel::LevelInterval;

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

const BoundTable* tableOf(const std::vector<BoundTable>& tables, int column) {
  const auto found =
      std::find_if(tables.begin(), tables.end(), [&](const BoundTable& t) { return t.column == column; });
  return found == tables.end() ? nullptr : &*found;
}

}  // namespace

BoundTable buildBounds(const ValueLevels& levels, const TransferFunction& transfer, int column) {
  BoundTable table{};
  table.column = column;
  const int count = int(levels.values.size());
  for (int i = 0; i < count; ++i) {
    const auto level = std::uint8_t(i), next = std::uint8_t(i + 1);
    table.largest[0][i] = transfer.majorant(levels.decode({level, level}));
    if (i + 1 < count) table.largest[1][i] = transfer.majorant(levels.decode({level, next}));
  }
  for (int row = 2; row < 9; ++row)
    for (int i = 0, half = 1 << (row - 2); i + 2 * half < count; ++i)
      table.largest[row][i] = std::max(table.largest[row - 1][i], table.largest[row - 1][i + half]);
  return table;
}

std::size_t MajorantGrid::update(std::shared_ptr<const MacrocellGrid> macrocells,
                                 std::vector<BoundTable> tables, bool sums) {
  const bool all = macrocells != macrocells_ || sums != sums_;
  std::vector<Change> changes;
  for (int column = 0; column < int(macrocells->levels.size()); ++column)
    addChange(tableOf(tables_, column), tableOf(tables, column), changes);
  if (macrocells != macrocells_) totals_ = std::vector<float>(macrocells->cellCount());
  macrocells_ = std::move(macrocells);
  tables_ = std::move(tables);
  sums_ = sums;
  if (!all && changes.empty()) return 0;

  const std::size_t columns = macrocells_->levels.size();
  std::atomic<std::size_t> touched = 0;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, totals_.size(), 4096), [&](const auto& range) {
    std::size_t count = 0;
    for (std::size_t cell = range.begin(); cell < range.end(); ++cell) {
      const LevelInterval* intervals = &macrocells_->intervals[cell * columns];
      if (!all && std::none_of(changes.begin(), changes.end(),
                               [&](const Change& change) { return change.meets(intervals[change.column]); }))
        continue;
      totals_[cell] = totalOf(intervals);
      ++count;
    }
    touched += count;
  });
  return touched;
}

float MajorantGrid::totalOf(const LevelInterval* intervals) const {
  float total = 0.0f;
  for (const BoundTable& table : tables_) {
    const float bound = table.over(intervals[table.column]);
    total = sums_ ? total + bound : std::max(total, bound);
  }
  return total;
}

kernel::MajorantView MajorantGrid::view() const {
  return {macrocells_->cells,
          float(macrocells_->size),
          totals_.data(),
          macrocells_->intervals.data(),
          int(macrocells_->levels.size()),
          tables_.data()};
}

}  // namespace scolopax
