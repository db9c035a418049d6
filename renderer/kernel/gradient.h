// SPDX-License-Identifier: Apache-2.0
// The gradient of a field at a point.
#pragma once
#include "renderer/kernel/filters.h"

namespace scolopax::kernel {

template <class L>
SCOLOPAX_LANES typename L::Vec product(const glm::mat3& m, const typename L::Vec& v) {
  using Vec = typename L::Vec;
  return Vec(m[0]) * v[0] + Vec(m[1]) * v[1] + Vec(m[2]) * v[2];
}

template <class Vec>
SCOLOPAX_LANES auto largestComponent(const Vec& v) {
  return maximum(maximum(magnitude(v[0]), magnitude(v[1])), magnitude(v[2]));
}

template <class L>
struct Gradient {
  typename L::Vec perSpacing;  ///< gradient of stored values in world space, per smallest spacing
  typename L::Mask finite;     ///< where all differences are finite
};

/// `point` is in voxel coordinates. Central differences of one voxel of the trilinear interpolation,
/// one-sided at the border; for the cubic B-spline, its own gradient.
template <class L>
SCOLOPAX_LANES Gradient<L> gradientAt(const FieldView& field, glm::ivec3 dims, const glm::mat3& fromVoxel,
                                      const typename L::Vec& point) {
  using Float = typename L::Float;
  using Vec = typename L::Vec;
  Vec perVoxel(0.0f);
  if (field.has(Filter::cubic)) [[unlikely]] {
    findSplineGradient(field, dims, point, &perVoxel);
  } else {
    for (int axis = 0; axis < 3; ++axis) {
      if (dims[axis] < 2) continue;
      const float last = float(dims[axis] - 1);
      const Float at = clamp(point[axis], 0.0f, last);
      Vec low = point, high = point;
      low[axis] = maximum(at - 1.0f, 0.0f);
      high[axis] = minimum(at + 1.0f, last);
      const Float difference = sampleTrilinear(field, dims, high) - sampleTrilinear(field, dims, low);
      perVoxel[axis] = difference / (high[axis] - low[axis]);
    }
  }
  const typename L::Mask finite = isFinite(perVoxel[0]) & isFinite(perVoxel[1]) & isFinite(perVoxel[2]);
  return {product<L>(fromVoxel, perVoxel), finite};
}
/// Number of trilinear samples that gradientAt() costs as much as.
SCOLOPAX_HD inline unsigned gradientFetches(const FieldView& field, glm::ivec3 dims) {
  return field.has(Filter::cubic) ? 2 * field.cost()
                                  : 2u * (unsigned(dims.x > 1) + unsigned(dims.y > 1) + unsigned(dims.z > 1));
}

/// Length of a vector whose squared components may overflow or underflow.
template <class L>
SCOLOPAX_LANES typename L::Float lengthOf(const typename L::Vec& v) {
  using Float = typename L::Float;
  using Vec = typename L::Vec;
  const Float largest = largestComponent(v), divisor = maximum(largest, Float(kLeastNormal));
  const Vec scaled(v[0] / divisor, v[1] / divisor, v[2] / divisor);
  return select(largest < kInfinity, divisor * squareRoot(dot(scaled, scaled)), largest);
}

}  // namespace scolopax::kernel
