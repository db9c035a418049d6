// SPDX-License-Identifier: Apache-2.0
// Bounds of channels whose extinction depends on more than their value. Each gets a column of its own in the
// macrocells, which holds one level of the extinction per cell. Kernels treat it like any other column.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/gradient_cells.h"
#include "renderer/data/gradient_factor.h"

namespace scolopax {

struct BoundColumn {
  ValueLevels levels;               ///< of the extinction, per world unit
  std::vector<std::uint8_t> cells;  ///< per macrocell: the least level that is a bound
};

/// Bounds the extinction of `channel` in every macrocell: its bound by value (`ofValues`, for a factor of 1)
/// times the largest factor in the cell. The memory is charged to `memory`, if given.
std::shared_ptr<const BoundColumn> buildBoundColumn(const MacrocellGrid& macrocells, int channel,
                                                    const kernel::BoundTable& ofValues,
                                                    const GradientCells& gradients,
                                                    const GradientFactor& factor,
                                                    const std::shared_ptr<MemoryBudget>& memory = nullptr);

/// The macrocells with `columns` appended to those of the volume's channels.
std::shared_ptr<const MacrocellGrid> withColumns(const std::shared_ptr<const MacrocellGrid>& macrocells,
                                                 std::span<const std::shared_ptr<const BoundColumn>> columns,
                                                 const std::shared_ptr<MemoryBudget>& memory = nullptr);

}  // namespace scolopax
