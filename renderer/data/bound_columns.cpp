// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/bound_columns.h"

#include <algorithm>

#include "renderer/data/measuring.h"
#include "renderer/data/value_levels.h"

namespace scolopax {

std::shared_ptr<const CellColumn> buildBoundColumn(const MacrocellGrid& macrocells, int column,
                                                   const kernel::BoundTable& ofValues,
                                                   const GradientCells& gradients,
                                                   const GradientFactor& factor,
                                                   const std::shared_ptr<MemoryBudget>& memory,
                                                   const std::stop_token& stop) {
  const std::size_t cells = macrocells.cellCount(), columnBytes = cells * sizeof(kernel::LevelInterval);
  auto share = MemoryBudget::take(memory, MemoryUse::grids, columnBytes + cells * sizeof(ValueInterval));
  std::vector<float> factors;
  for (const float level : gradients.levels.values) factors.push_back(factor.largest(level));
  const std::size_t columns = macrocells.levels.size();
  std::vector<ValueInterval> bounds(cells);
  forEachOf(cells, kManyCells, stop, [&](std::size_t cell) {
    // Both factors are bounds and rounding is monotone, so their product in float is a bound too.
    const float bound = ofValues.over(macrocells.intervals[cell * columns + std::size_t(column)]) *
                        factors[gradients.cells[cell]];
    bounds[cell] = {bound, bound};
  });
  CellColumn result;
  result.levels.values = chooseLevels(bounds);
  result.cells.resize(cells);
  forEachOf(cells, kManyCells, stop, [&](std::size_t cell) {
    const std::uint8_t level = encode(result.levels, bounds[cell]).hi;
    result.cells[cell] = {level, level};
  });
  share.resize(columnBytes);
  return withShare(std::move(share), std::move(result));
}

std::shared_ptr<const MacrocellGrid> withColumns(const std::shared_ptr<const MacrocellGrid>& macrocells,
                                                 std::span<const std::shared_ptr<const CellColumn>> columns,
                                                 const std::shared_ptr<MemoryBudget>& memory,
                                                 const std::stop_token& stop) {
  if (columns.empty()) return macrocells;
  const std::size_t before = macrocells->levels.size(), after = before + columns.size();
  auto share = MemoryBudget::take(memory, MemoryUse::grids, macrocells->sizeBytes() / before * after);
  MacrocellGrid result;
  result.size = macrocells->size;
  result.cells = macrocells->cells;
  result.levels = macrocells->levels;
  for (const auto& column : columns) result.levels.push_back(column->levels);
  result.intervals.resize(macrocells->cellCount() * after);
  const CellBlocks blocks(macrocells->cells);
  result.blocks.resize(blocks.count() * after);
  forEachOf(blocks.count(), kManyBlocks, stop, [&](std::size_t block) {
    kernel::LevelInterval* all = &result.blocks[block * after];
    std::copy_n(&macrocells->blocks[block * before], before, all);
    std::fill_n(all + before, columns.size(), kernel::LevelInterval{255, 0});
    blocks.visitCells(block, [&](std::size_t cell) {
      kernel::LevelInterval* own = &result.intervals[cell * after];
      std::copy_n(&macrocells->intervals[cell * before], before, own);
      for (std::size_t i = 0; i < columns.size(); ++i) {
        const kernel::LevelInterval one = own[before + i] = columns[i]->cells[cell];
        kernel::LevelInterval& any = all[before + i];
        any = {std::min(any.lo, one.lo), std::max(any.hi, one.hi)};
      }
    });
  });
  return withShare(std::move(share), std::move(result));
}

}  // namespace scolopax
