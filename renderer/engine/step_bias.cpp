// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/step_bias.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/engine/thumbnails.h"

namespace scolopax {
namespace {

constexpr std::size_t kThumbnailSamples = 8;

double upper(const Estimate& estimate) {
  return std::max(0.0, estimate.value) + kDeviations * estimate.deviation;
}

}  // namespace

double estimateBias(Launcher& launcher, const RenderPlan& plan, const std::stop_token& stop) {
  Thumbnails thumbnails(launcher, plan, plan.scene().method, false, kMostBiasWork, stop);
  const double least = finestEstimatedStep(plan.grid());
  Resolution own = resolutionOf(plan.scene());
  own.step = std::max(own.step, least);
  const auto coarse = thumbnails.render(own, kThumbnailSamples);
  const auto middle = thumbnails.render({std::max(1.0, least), true}, kThumbnailSamples);
  const auto fine = thumbnails.render({std::max(0.5, least), true}, kThumbnailSamples);
  if (!coarse || !middle || !fine) return std::numeric_limits<double>::quiet_NaN();
  // The error is of second order in the longest segment: half of it gives a quarter of the error.
  return std::sqrt(upper(squaredDifference(*coarse, *fine))) +
         std::sqrt(upper(squaredDifference(*middle, *fine))) / 3;
}

}  // namespace scolopax
