// SPDX-License-Identifier: Apache-2.0
// Macrocells, and what is known of gradients in them, that all renderers of a volume share, measured off
// their threads.
#pragma once
#include <memory>
#include <stop_token>

#include "renderer/core/memory_budget.h"
#include "renderer/data/gradient_cells.h"
#include "renderer/data/macrocell_grid.h"

namespace scolopax {

/// buildMacrocells, shared among all who ask for this volume and size while somebody holds the grid. Waits
/// while it is measured; throws Error(cancelled) once `stop` is requested. Measuring ends when nobody waits
/// for it. The grid's memory is of `memory`, if that is given.
std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size,
                                                      const std::stop_token& stop = {},
                                                      const std::shared_ptr<MemoryBudget>& memory = nullptr);

/// The same for buildGradientCells.
std::shared_ptr<const GradientCells> sharedGradientCells(
    const std::shared_ptr<const Volume>& volume, int channel, int size, const std::stop_token& stop = {},
    const std::shared_ptr<MemoryBudget>& memory = nullptr);

}  // namespace scolopax
