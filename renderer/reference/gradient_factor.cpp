// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/gradient_factor.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace scolopax::reference {
namespace {

constexpr double kNearExtremum = 0x1p-24;  // a kink this far from a cut causes an error of its square

ChannelCurves curveOf(const GradientOpacity& opacity) {
  ChannelAppearance appearance;
  appearance.rangeLo = opacity.rangeLo;
  appearance.rangeHi = opacity.rangeHi;
  appearance.opacity = opacity.factor;
  return ChannelCurves(appearance);
}

}  // namespace

void FactorAlong::appendCuts(std::vector<double>& cuts) const {
  const BernsteinVector& g = gradient_.scaled;
  const Bernstein& scale = gradient_.scale;
  const double longest = g.longest(), noise = kPolynomialNoise * longest * longest;
  const Bernstein squared = g.dot(g), scaleSquared = scale * scale;
  for (const double value : curve_->breakpoints()) {
    if (!(value > 0)) continue;  // |gradient| does not cross 0
    if (value * scale.lower() > longest) break;
    const double most = value * scale.upper();
    (squared - scaleSquared * (value * value))
        .appendSignChanges(std::max(noise, kPolynomialNoise * most * most), cuts);
  }
  // d/du (|g|^2 / scale^2) = 2 (g.g' scale - g.g scale') / scale^3. Where |g| is zero, or nearly so, its
  // square has a double root or none, but the derivative changes sign.
  const BernsteinVector change{g.x.derivative(), g.y.derivative(), g.z.derivative()};
  const Bernstein slope = g.dot(change) * scale - squared * scale.derivative();
  slope.appendSignChanges(noise * scale.upper(), cuts, kNearExtremum);
}

void FactorAlong::choosePieceAt(double u) { piece_ = curve_->pieceAt(position(u)); }

double FactorAlong::operator()(double u) const { return curve_->sample(piece_, position(u)).extinction; }

double FactorAlong::position(double u) const {
  return curve_->position(glm::length(gradient_.scaled(u)) / gradient_.scale(u));
}

GradientFactor::GradientFactor(const GradientOpacity& opacity, const glm::dmat3& worldFromGradient)
    : curve_(curveOf(opacity)), worldFromGradient_(worldFromGradient) {}

std::optional<FactorAlong> GradientFactor::along(const ScalarField& field, const glm::dvec3& begin,
                                                 const glm::dvec3& end) const {
  const auto gradient = gradientAlong(field, begin, end, worldFromGradient_);
  if (!gradient) return std::nullopt;
  if (!curve_.visibleBetween(0, gradient->scaled.longest() / gradient->scale.lower())) return std::nullopt;
  return FactorAlong(curve_, *gradient);
}

}  // namespace scolopax::reference
