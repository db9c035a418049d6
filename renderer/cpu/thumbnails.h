// SPDX-License-Identifier: Apache-2.0
// Small pictures of a plan's scene by quadrature, to learn how far its step is from small enough.
#pragma once
#include <optional>
#include <vector>

#include "renderer/data/render_plan.h"

namespace scolopax {

/// Side of the pictures, pixels: the longer one.
inline constexpr int kThumbnailSide = 24, kLitThumbnailSide = 12;

/// RMSE, over linear premultiplied RGBA, of the expected picture of the plan's scene by quadrature at its
/// step: what half the step, and strata half as thick, change of it, as an error of order 2 has it (4/3 of
/// that). Two pictures of each, with random numbers of their own, tell it from noise. Takes the threads of
/// the caller's arena.
double estimateBias(const RenderPlan& plan);

/// A step, and the bias that was found for it.
struct BiasedStep {
  double step;  ///< smallest spacings
  double bias;
};

/// The largest of 4, 2, 1, ... 1/8 at which the bias without light is at most `target`; none when it is at
/// none. The same for the same scene and volume, whatever the picture's size.
std::optional<BiasedStep> largestStep(const RenderPlan& plan, double target);

}  // namespace scolopax
