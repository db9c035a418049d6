// SPDX-License-Identifier: Apache-2.0
// Macrocells, and bounds of the gradients in them, shared by all renderers of a volume and measured on
// threads of their own.
#pragma once
#include <memory>
#include <stop_token>

#include "renderer/core/memory_budget.h"
#include "renderer/data/gradient_cells.h"
#include "renderer/data/macrocell_grid.h"

namespace scolopax {

/// buildMacrocells, shared by all callers that request this volume and size while one of them holds the grid.
/// Waits while it is measured; throws Error(cancelled) once `stop` is requested. Measuring stops when no
/// caller waits any more. The grid's memory is charged to `memory`, if given; throws Error(busy) or
/// Error(tooLarge) if it refuses.
std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size,
                                                      const std::stop_token& stop = {},
                                                      const std::shared_ptr<MemoryBudget>& memory = nullptr);

/// The same for buildSplineColumn.
std::shared_ptr<const CellColumn> sharedSplineColumn(const std::shared_ptr<const Volume>& volume, int channel,
                                                     int size, const std::stop_token& stop = {},
                                                     const std::shared_ptr<MemoryBudget>& memory = nullptr);

/// The same for buildGradientCells. Only Interpolation::cubic has gradients of its own.
std::shared_ptr<const GradientCells> sharedGradientCells(
    const std::shared_ptr<const Volume>& volume, int channel, int size, Interpolation interpolation,
    const std::stop_token& stop = {}, const std::shared_ptr<MemoryBudget>& memory = nullptr);

}  // namespace scolopax
