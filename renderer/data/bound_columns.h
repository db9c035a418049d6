// SPDX-License-Identifier: Apache-2.0
// Bounds of channels whose extinction depends on more than their value. Each gets a column of its own in the
// macrocells, which holds one level of the extinction per cell. Kernels treat it like any other column.
#pragma once
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/gradient_cells.h"
#include "renderer/data/gradient_factor.h"

namespace scolopax {

/// Bounds the extinction of the channel in `column` of the macrocells: its bound by value (`ofValues`, for a
/// factor of 1) times the largest factor in the cell. The levels of the result are of the extinction, per
/// world unit; each interval is the least level that is a bound. The memory is charged to `memory`, if given.
/// Throws Error(cancelled) once `stop` is requested.
std::shared_ptr<const CellColumn> buildBoundColumn(const MacrocellGrid& macrocells, int column,
                                                   const kernel::BoundTable& ofValues,
                                                   const GradientCells& gradients,
                                                   const GradientFactor& factor,
                                                   const std::shared_ptr<MemoryBudget>& memory = nullptr,
                                                   const std::stop_token& stop = {});

/// The macrocells with `columns` appended to those of the volume's channels. Throws Error(cancelled) once
/// `stop` is requested.
std::shared_ptr<const MacrocellGrid> withColumns(const std::shared_ptr<const MacrocellGrid>& macrocells,
                                                 std::span<const std::shared_ptr<const CellColumn>> columns,
                                                 const std::shared_ptr<MemoryBudget>& memory = nullptr,
                                                 const std::stop_token& stop = {});

}  // namespace scolopax
