// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/surfaces.h"

#include <cmath>
#include <utility>

#include "renderer/core/error.h"

namespace scolopax::reference {
namespace {

/// Positions of the interior maxima of the curve, and the opacity there.
std::vector<std::pair<double, double>> peaksIn(const std::vector<OpacityKnot>& curve) {
  // Of several knots at one position, only the first and the last can be seen: the limits from both sides.
  std::vector<OpacityKnot> seen;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const bool first = i == 0 || curve[i - 1].position != curve[i].position;
    const bool last = i + 1 == curve.size() || curve[i + 1].position != curve[i].position;
    if (first || last) seen.push_back(curve[i]);
  }
  std::vector<std::pair<double, double>> peaks;
  for (std::size_t i = 1; i + 1 < seen.size(); ++i) {
    if (!(seen[i].value > seen[i - 1].value)) continue;
    std::size_t j = i;  // the plateau's other end
    while (j + 1 < seen.size() && seen[j + 1].value == seen[i].value) ++j;
    if (j + 1 == seen.size() || seen[j + 1].value > seen[i].value) continue;
    const double middle = 0.5 * (seen[i].position + seen[j].position);
    if (middle > 0 && middle < 1) peaks.emplace_back(middle, seen[i].value);
  }
  return peaks;
}

}  // namespace

std::vector<Surface> surfacesOf(const ChannelAppearance& appearance, const ChannelCurves& curves,
                                double smallestSpacing) {
  std::vector<Surface> surfaces;
  const auto colorAt = [&](double position) {
    return curves.sample(curves.pieceAt(position), position).color;
  };
  for (const Isovalue& isovalue : appearance.isovalues) {
    if (!std::isfinite(isovalue.value) || !(isovalue.opacity >= 0 && isovalue.opacity <= 1))
      throw Error(ErrorCode::badInput, "reference: an isovalue must be finite, its opacity in [0,1]");
    if (isovalue.opacity > 0)
      surfaces.push_back({isovalue.value, isovalue.opacity,
                          isovalue.color ? *isovalue.color : colorAt(curves.position(isovalue.value))});
  }
  const double lo = appearance.rangeLo, hi = appearance.rangeHi;
  if (appearance.peaks == Peaks::off || lo == hi) return surfaces;
  for (const auto& [position, opacity] : peaksIn(appearance.opacity)) {
    const double alpha = -std::expm1(-opacity * appearance.density * smallestSpacing);
    if (alpha > 0)
      surfaces.push_back(
          {lo + std::pow(position, 1 / appearance.gamma) * (hi - lo), alpha, colorAt(position)});
  }
  return surfaces;
}

}  // namespace scolopax::reference
