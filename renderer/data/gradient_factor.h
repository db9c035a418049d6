// SPDX-License-Identifier: Apache-2.0
// The curve that scales a channel's opacity by the gradient's magnitude, in the form that the kernels
// evaluate.
#pragma once
#include "renderer/data/curve.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/views/gradient_factor_view.h"

namespace scolopax {

class GradientFactor {
 public:
  /// Throws Error(badInput), naming the fault: no knots, positions that decrease, values out of range, a
  /// range that is not finite.
  GradientFactor(const GradientOpacity& look, const ChannelFacts& channel, const Grid& grid);
  /// Valid while this object lives.
  kernel::GradientFactorView view() const;
  /// Largest factor that the kernels can compute where |gradient|, in stored values per smallest spacing, is
  /// at most `magnitude`.
  float largest(float magnitude) const;
  /// Whether the factor is `value` for every finite gradient.
  bool isEverywhere(float value) const;

 private:
  Curve<float> curve_;
  OpticalCurve optical_;
  Placement placement_;
  glm::mat3 fromVoxel_;
};

}  // namespace scolopax
