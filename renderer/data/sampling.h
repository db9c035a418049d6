// SPDX-License-Identifier: Apache-2.0
// What the samples of all pixels of a pass have in common; launchers compute it once per pass.
#pragma once
#include <cstdint>

#include "renderer/data/method.h"
#include "renderer/kernel/rng.h"

namespace scolopax {

inline constexpr int kSobolDimensions =
    3 * int(kernel::kLowDiscrepancySamplers * kernel::kLowDiscrepancyBlocks);

/// Coordinate `dimension` (below kSobolDimensions) of point `index` of the Sobol sequence, times 2^32;
/// direction numbers of Joe and Kuo, "Constructing Sobol sequences with better two-dimensional projections",
/// SIAM J. Sci. Comput. 30(5), 2008.
std::uint32_t sobol(int dimension, std::uint32_t index);

/// `sample` below 2^31.
kernel::SampleNumber sampleNumber(Sampling sampling, std::uint32_t sample);

}  // namespace scolopax
