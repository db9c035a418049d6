// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/gradient_factor.h"

#include <algorithm>
#include <cmath>

#include "renderer/core/error.h"
#include "renderer/kernel/classifiers/curve_times_curve.h"

namespace scolopax {
namespace {

/// Factor from data units per world unit to stored values per smallest spacing.
double storedPerSpacing(const ChannelFacts& channel, const Grid& grid) {
  return grid.smallestSpacing() / std::abs(channel.slope);
}

}  // namespace

GradientFactor::GradientFactor(const GradientOpacity& look, const ChannelFacts& channel, const Grid& grid)
    : curve_(makeCurve(look.factor, "gradientOpacity")),
      optical_(
          makeOpticalCurve(curve_, makeCurve(std::vector<ColorKnot>{{0, {1, 1, 1}}}, "gradientOpacity"))),
      placement_(look.rangeLo * storedPerSpacing(channel, grid),
                 look.rangeHi * storedPerSpacing(channel, grid), look.rangeLo <= look.rangeHi),
      fromVoxel_(grid.gradientFromVoxel()) {
  if (!std::isfinite(look.rangeLo) || !std::isfinite(look.rangeHi))
    throw Error(ErrorCode::badInput,
                "channel '" + channel.name + "': the range of gradientOpacity must be finite");
}

kernel::GradientFactorView GradientFactor::view() const {
  return {placement_.origin, placement_.scale, placement_.offset, curve_.view(), optical_.view(), fromVoxel_};
}

float GradientFactor::largest(float magnitude) const {
  return kernel::largestFactor(view(), 0.0f, magnitude);
}

bool GradientFactor::isEverywhere(float value) const {
  return std::all_of(curve_.values.begin(), curve_.values.end(), [&](float v) { return v == value; });
}

}  // namespace scolopax
