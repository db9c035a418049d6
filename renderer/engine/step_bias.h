// SPDX-License-Identifier: Apache-2.0
// Estimates the bias of quadrature by rendering thumbnails of a plan's scene at several resolutions.
#pragma once
#include <cstdint>
#include <stop_token>

#include "renderer/data/render_plan.h"
#include "renderer/launcher.h"

namespace scolopax {

/// The bias reported is the estimate plus this many standard deviations. If the rays of the thumbnails were
/// drawn at random, and were many, the estimate would be too low for one scene in 44.
inline constexpr double kDeviations = 2;

/// Fetches and visits of macrocells that the thumbnails of an estimate may take.
inline constexpr std::uint64_t kMostBiasWork = std::uint64_t(1) << 32;

/// Bias of quadrature at the step of the plan's scene, with its lighting: the RMSE of the expected picture
/// over linear premultiplied RGBA. Measured as the difference from the picture voxel cell by voxel cell, with
/// segments of at most half the smallest spacing, plus an extrapolation to even shorter ones. For a step
/// below finestEstimatedStep(), returns the bias of that. NaN, not known, if it takes more than
/// kMostBiasWork, as with many lights over many voxels. Runs in the caller's thread arena, like
/// Launcher::launch. Throws Error(cancelled) soon after `stop` is requested.
double estimateBias(Launcher& launcher, const RenderPlan& plan, const std::stop_token& stop = {});

}  // namespace scolopax
