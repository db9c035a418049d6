// SPDX-License-Identifier: Apache-2.0
// Curves as kernels read them. data/curve owns them; classify.h and, for quadrature, optical_curve.h evaluate
// them.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>

namespace scolopax::kernel {

inline constexpr int kCurveBuckets = 256;

/// Piecewise-linear curve over [0,1], constant before its first knot and after its last.
template <class Value>
struct CurveView {
  const float* positions;  ///< not decreasing
  const Value* values;
  const std::uint16_t* buckets;  ///< kCurveBuckets + 1: last knot at or before the bucket's start, or 0
  int count;
};

/// Opacity and colour at a knot of either curve.
struct OpticalKnot {
  float position;
  float inverseWidth;  ///< 1 / distance to the next knot, or 0
  float stored;        ///< stored value at this knot, less the channel's origin; negated where
                       ///< positions fall as stored values rise
  float opacity;
  glm::vec3 color;  ///< linear RGB
};
inline constexpr int kKnotFloats = sizeof(OpticalKnot) / sizeof(float);

/// The opacity and colour curves of a channel, merged: both are given at the knots of either. The first knot
/// is at 0 and the last at 1.
struct OpticalCurveView {
  const OpticalKnot* knots;
  const std::uint16_t* buckets;  ///< as in CurveView
  int count;
  bool jumps;         ///< some knots share a position
  float first, last;  ///< the opacity is 0 at positions up to `first` and from `last` on
};

}  // namespace scolopax::kernel
