// SPDX-License-Identifier: Apache-2.0
// Opacity by the magnitude of the gradient, in double: the factor along the part of a ray inside one cell,
// and where it has a kink or a jump, so that the integrator can cut the ray there.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "renderer/reference/channel_curves.h"
#include "renderer/reference/gradient_along.h"

namespace scolopax::reference {

/// The factor of one channel's opacity along a straight line, u in [0,1].
class FactorAlong {
 public:
  /// `curve` is kept by reference. `gradient` is in data units per world unit.
  FactorAlong(const ChannelCurves& curve, const GradientAlong& gradient)
      : curve_(&curve), gradient_(gradient) {}
  /// Appends every u in (0,1) at which |gradient| takes a value where the curve has a knot, or is smallest or
  /// largest: at zero it has a kink. Between two of them the factor is smooth.
  void appendCuts(std::vector<double>& cuts) const;
  /// From now on, evaluates the piece of the curve that applies at u, so that a rounding error does not carry
  /// a point to the other side of a jump.
  void choosePieceAt(double u);
  double operator()(double u) const;

 private:
  double position(double u) const;
  const ChannelCurves* curve_;
  GradientAlong gradient_;
  std::size_t piece_ = 0;
};

class GradientFactor {
 public:
  /// `worldFromGradient` converts changes per voxel step to changes per world unit. Throws Error(badInput)
  /// for a range that is not finite, or an empty or descending curve.
  GradientFactor(const GradientOpacity& opacity, const glm::dmat3& worldFromGradient);
  /// False if the factor is 0 for every gradient.
  bool visible() const { return curve_.visible(); }
  /// The factor from `begin` to `end`, as in gradientAlong. None if it is 0 throughout, as where a difference
  /// is not finite. Valid while this object lives and is not moved.
  std::optional<FactorAlong> along(const ScalarField& field, const glm::dvec3& begin,
                                   const glm::dvec3& end) const;

 private:
  ChannelCurves curve_;  // its extinction is the factor
  glm::dmat3 worldFromGradient_;
};

}  // namespace scolopax::reference
