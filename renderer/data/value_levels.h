// SPDX-License-Identifier: Apache-2.0
// Chooses the values at which the intervals of a channel's macrocells may begin and end.
#pragma once
#include <span>

#include "renderer/data/macrocell_grid.h"

namespace scolopax {

/// Levels from the ends of intervals, as described for buildMacrocells; the least and the largest end are
/// always among them.
std::vector<float> chooseLevels(std::span<const ValueInterval> intervals);

/// The smallest interval of levels that contains `interval`, which must lie between the first and the last
/// level; the level of NaN if lo > hi.
kernel::LevelInterval encode(const ValueLevels& levels, ValueInterval interval);

}  // namespace scolopax
