// SPDX-License-Identifier: Apache-2.0
// Opacity by the magnitude of the gradient, as kernels read it. data/gradient_factor fills it;
// classifiers/curve_times_curve.h evaluates it.
#pragma once
#include <glm/mat3x3.hpp>

#include "renderer/kernel/views/curve_view.h"

namespace scolopax::kernel {

/// Factor of the opacity that depends on |gradient|, in stored values per smallest spacing.
struct GradientFactorView {
  float origin, scale, offset;  ///< position = clamp((|gradient| - origin) * scale + offset, 0, 1)
  CurveView<float> curve;       ///< no knots: opacity does not depend on the gradient
  OpticalCurveView optical;     ///< the same curve, for quadrature
  glm::mat3 fromVoxel;          ///< as SceneView::gradientFromVoxel
};

}  // namespace scolopax::kernel
