// SPDX-License-Identifier: Apache-2.0
// Small pictures of a plan's scene by quadrature, to learn how far its step is from small enough.
#pragma once
#include <optional>
#include <stop_token>

#include "renderer/data/render_plan.h"
#include "renderer/launcher.h"

namespace scolopax {

/// Side of the pictures, pixels: the longer one.
inline constexpr int kThumbnailSide = 24, kLitThumbnailSide = 16;
/// The bias claimed is this many standard deviations above the estimate. If the rays of the small pictures
/// were drawn at random, and were many, a single estimate would be too low for one scene in 44. largestStep
/// takes the first step that passes, after up to four estimates of each, so it errs more often.
inline constexpr double kDeviations = 2;

/// RMSE, over linear premultiplied RGBA, of the expected picture of the plan's scene by quadrature at its
/// step, with all its light: what a quarter of the step, and of a voxel, changes of it, and what still
/// smaller steps would as the last differences foretell. No step is so small that a ray has more than 2^16 of
/// them; for such a one, the bias of the smallest that is not. Takes the caller's threads, as
/// Launcher::launch. Throws Error(cancelled) soon after `stop` is requested.
double estimateBias(Launcher& launcher, const RenderPlan& plan, const std::stop_token& stop = {});

/// A step, and the bias that was found for it.
struct BiasedStep {
  double step;  ///< smallest spacings
  double bias;
};

/// The largest of 4, 2, 1, ... 1/8 at which the bias of `method` is at most `target`; none when it is at
/// none. The same for the same scene and volume, whatever the picture's size. `rays`: how many it took, at
/// most 32 times kThumbnailSide^2 for each of eight steps. Throws Error(cancelled) soon after `stop` is
/// requested.
std::optional<BiasedStep> largestStep(Launcher& launcher, const RenderPlan& plan, Method method,
                                      double target, const std::stop_token& stop = {},
                                      std::uint64_t* rays = nullptr);

}  // namespace scolopax
