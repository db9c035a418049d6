// SPDX-License-Identifier: Apache-2.0
// The curve by which the gradient's magnitude changes a channel's opacity, in the form the kernels evaluate.
#pragma once
#include "renderer/data/curve.h"
#include "renderer/data/volume.h"

namespace scolopax {

class GradientFactor {
 public:
  /// Throws Error(badInput) naming what is wrong: no knots, positions that decrease, values out of range.
  GradientFactor(const GradientOpacity& look, const Channel& channel, const Grid& grid);
  /// Valid as long as this object.
  kernel::GradientFactorView view() const;
  /// Largest factor that the kernels find where |gradient|, of stored values per smallest spacing, is at most
  /// this.
  float largest(float magnitude) const;
  /// Whether the factor is `value` whatever the gradient is.
  bool isEverywhere(float value) const;

 private:
  Curve<float> curve_;
  OpticalCurve optical_;
  Placement placement_;
  glm::mat3 fromVoxel_;
};

}  // namespace scolopax
