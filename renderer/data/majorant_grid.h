// SPDX-License-Identifier: Apache-2.0
// Upper bounds of the extinction per macrocell. Each channel's bounds are kept apart, so that an edit
// rebuilds one channel; combine() interleaves the visible ones for the kernels.
#pragma once
#include <span>
#include <vector>

#include "renderer/data/transfer_function.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// Bounds of one channel, one per macrocell: for every sample x of the cell, extinction(x) <= bound, in
/// float.
std::vector<float> buildMajorants(const std::vector<ValueInterval>& intervals,
                                  const TransferFunction& transfer);

/// Interleaves the bounds of the visible channels: per cell their sum (or, for blend modes that show one
/// channel at a point, their maximum), then each.
std::vector<float> combineMajorants(std::span<const std::vector<float>* const> channels, std::size_t cells,
                                    bool sums);

}  // namespace scolopax
