// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/surfaces.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/data/curve.h"
#include "renderer/kernel/classify.h"

namespace scolopax {

std::vector<Peak> peaksOf(const std::vector<OpacityKnot>& curve) {
  std::vector<Peak> peaks;
  const std::size_t count = curve.size();
  bool rises = false;          // to the plateau that is followed
  double begin = 0, last = 0;  // where it begins, and its value
  for (std::size_t i = 0; i < count; ++i) {
    const OpacityKnot& knot = curve[i];
    // A knot between two others at its position is never reached.
    if (i > 0 && i + 1 < count && curve[i - 1].position == knot.position &&
        curve[i + 1].position == knot.position)
      continue;
    if (i > 0 && knot.value < last && rises) {
      // The plateau ends at the knot before this one, or in a jump at this one's position.
      const double end = curve[i - 1].position, middle = 0.5 * (begin + end);
      if (middle > 0 && middle < 1) peaks.push_back({middle, last});
    }
    if (i == 0 || knot.value != last) {
      rises = i > 0 && knot.value > last;
      begin = knot.position;
    }
    last = knot.value;
  }
  return peaks;
}

Surfaces::Surfaces(const ChannelFacts& channel, const ChannelAppearance& appearance, float origin,
                   double smallestSpacing) {
  const auto fail = [&](const std::string& what) {
    throw Error(ErrorCode::badInput, "channel '" + channel.name + "': " + what);
  };
  if (appearance.isovalues.empty() && appearance.peaks == Peaks::off) return;
  const Curve<glm::vec3> color = makeCurve(appearance.color, "colormap");
  const double lo = appearance.rangeLo, hi = appearance.rangeHi;
  const auto positionOf = [&](double value) {
    if (lo == hi) return value < lo ? 0.0 : 1.0;
    return std::pow(std::clamp((value - lo) / (hi - lo), 0.0, 1.0), appearance.gamma);
  };
  const auto add = [&](double value, double opacity, const glm::vec3& shown) {
    const float stored = float((value - channel.intercept) / channel.slope);
    const float away = stored - origin;
    stored_.push_back(stored);
    views_.push_back({channel.slope < 0 ? -away : away, float(opacity), shown});
  };
  for (const Isovalue& isovalue : appearance.isovalues) {
    if (!std::isfinite(isovalue.value))
      fail("isovalues: expected finite values, found " + shortText(isovalue.value));
    if (!(isovalue.opacity >= 0 && isovalue.opacity <= 1))
      fail("isovalues: expected opacities from 0 to 1, found " + shortText(isovalue.opacity));
    if (!(isovalue.opacity > 0)) continue;
    add(isovalue.value, isovalue.opacity,
        isovalue.color ? glm::vec3(*isovalue.color)
                       : kernel::evaluate(color.view(), float(positionOf(isovalue.value))));
  }
  if (appearance.peaks != Peaks::off && lo != hi)
    for (const Peak& peak : peaksOf(appearance.opacity)) {
      const double alpha = -std::expm1(-peak.value * appearance.density * smallestSpacing);
      if (float(alpha) > 0)
        add(lo + std::pow(peak.position, 1 / appearance.gamma) * (hi - lo), alpha,
            kernel::evaluate(color.view(), float(peak.position)));
    }
  if (views_.size() > std::size_t(kernel::kMaxSurfaces))
    fail("expected at most " + std::to_string(kernel::kMaxSurfaces) + " isovalues and peaks, found " +
         std::to_string(views_.size()));
}

void Surfaces::addTo(kernel::ChannelView& view) const {
  view.surfaces = views_.data();
  view.surfaceCount = int(views_.size());
}

float Surfaces::presence(ValueInterval interval, float range) const {
  // A sample whose value is within rounding of a surface's may lie on either side of it. Rounding
  // affects the value, and the point, whose error the steepest slope multiplies. The slack is enough up to a
  // thousand voxels from the eye.
  const float slack = 0x1p-19f * std::max(std::abs(interval.lo), std::abs(interval.hi)) + 0x1p-11f * range;
  const bool some = std::any_of(stored_.begin(), stored_.end(), [&](float v) {
    return interval.lo - slack <= v && v <= interval.hi + slack;
  });
  return some ? 1.0f : 0.0f;
}

}  // namespace scolopax
