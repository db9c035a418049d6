// SPDX-License-Identifier: Apache-2.0
// Which values of a channel the intervals of its macrocells may begin and end at.
#pragma once
#include <span>

#include "renderer/data/macrocell_grid.h"

namespace scolopax {

/// Levels from the ends of intervals, as declared for buildMacrocells; the least and the largest are among
/// them.
std::vector<float> chooseLevels(std::span<const ValueInterval> intervals);

/// The smallest interval of levels around an interval that lies between the first and the last.
kernel::LevelInterval encode(const ValueLevels& levels, ValueInterval interval);

}  // namespace scolopax
