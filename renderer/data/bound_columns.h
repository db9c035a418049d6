// SPDX-License-Identifier: Apache-2.0
// Bounds of channels whose extinction depends on more than their value: a column of their own in the
// macrocells, in which a cell has one level of the extinction. Kernels see no difference.
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

/// Bounds `channel` of the macrocells, which `ofValues` bounds where the factor is 1. The memory is of the
/// budget, if there is one.
std::shared_ptr<const BoundColumn> buildBoundColumn(const MacrocellGrid& macrocells, int channel,
                                                    const kernel::BoundTable& ofValues,
                                                    const GradientCells& gradients,
                                                    const GradientFactor& factor,
                                                    const std::shared_ptr<MemoryBudget>& memory = nullptr);

/// The macrocells with further columns, behind those of the volume's channels.
std::shared_ptr<const MacrocellGrid> withColumns(const std::shared_ptr<const MacrocellGrid>& macrocells,
                                                 std::span<const std::shared_ptr<const BoundColumn>> columns,
                                                 const std::shared_ptr<MemoryBudget>& memory = nullptr);

}  // namespace scolopax
