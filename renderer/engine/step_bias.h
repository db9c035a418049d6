// SPDX-License-Identifier: Apache-2.0
// Estimates the bias of quadrature at a step by rendering thumbnails of a plan's scene at several steps.
#pragma once
#include <optional>
#include <stop_token>

#include "renderer/data/render_plan.h"
#include "renderer/launcher.h"

namespace scolopax {

/// Longer side of a thumbnail, in pixels; the second is for scenes with shading or shadows.
inline constexpr int kThumbnailSide = 24, kLitThumbnailSide = 16;
/// The bias reported is the estimate plus this many standard deviations. If the rays of the thumbnails were
/// drawn at random, and were many, a single estimate would be too low for one scene in 44. largestStep takes
/// the first step that passes, after up to four estimates of each, so it errs more often.
inline constexpr double kDeviations = 2;

/// Bias of quadrature at the step of the plan's scene, with its lighting: the RMSE of the expected picture
/// over linear premultiplied RGBA. Measured as the difference from the picture at a fine step, which is a
/// quarter of the step and at most a quarter of the smallest spacing, plus an extrapolation of the last
/// differences to even smaller steps. Steps so small that a ray has more than 2^16 of them are not rendered;
/// for such a step, returns the bias of the smallest step that is rendered. Runs in the caller's thread
/// arena, like Launcher::launch. Throws Error(cancelled) soon after `stop` is requested.
double estimateBias(Launcher& launcher, const RenderPlan& plan, const std::stop_token& stop = {});

/// A step, and the bias that was estimated for it.
struct BiasedStep {
  double step;  ///< smallest spacings
  double bias;
};

/// The largest of the steps 4, 2, 1, ... 1/8 at which the bias of `method` is at most `target`; none if there
/// is no such step. The same for the same scene and volume, whatever the picture's size at a given aspect
/// ratio. `rays` receives the number of rays that were needed, at most 32 times kThumbnailSide^2 for each of
/// eight steps. Throws Error(cancelled) soon after `stop` is requested.
std::optional<BiasedStep> largestStep(Launcher& launcher, const RenderPlan& plan, Method method,
                                      double target, const std::stop_token& stop = {},
                                      std::uint64_t* rays = nullptr);

}  // namespace scolopax
