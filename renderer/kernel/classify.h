// SPDX-License-Identifier: Apache-2.0
// Stored value -> position on the curves -> extinction and colour. Every step is monotone in float arithmetic
// (gamma nearly so, which largestExtinction allows for). So a bound that data/majorant_grid takes over an
// interval's ends and the knots inside it holds to the last bit.
#pragma once
#include "renderer/kernel/math.h"
#include "renderer/kernel/views.h"

namespace scolopax::kernel {

/// Index of the last knot at or before p, or -1 when p lies before the first.
template <class Value>
SCOLOPAX_HD int knotBefore(const CurveView<Value>& curve, float p) {
  // Bisection, because all knots may lie in one bucket.
  const int bucket = int(p * float(kCurveBuckets));
  int low = curve.buckets[bucket], high = curve.buckets[bucket < kCurveBuckets ? bucket + 1 : bucket];
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (curve.positions[middle] <= p)
      low = middle;
    else
      high = middle - 1;
  }
  return p < curve.positions[low] ? -1 : low;
}

/// Interpolates from a to b; the result lies between them even after rounding.
SCOLOPAX_HD inline float between(float a, float b, float t) {
  const float v = a + t * (b - a);
  return a < b ? clamp(v, a, b) : clamp(v, b, a);
}
SCOLOPAX_HD inline glm::vec3 between(glm::vec3 a, glm::vec3 b, float t) { return a + t * (b - a); }

/// Value of the curve at p in [0,1]. If two knots share a position, the later one holds there.
template <class Value>
SCOLOPAX_HD Value evaluate(const CurveView<Value>& curve, float p) {
  if (curve.count == 1) return curve.values[0];
  const int i = knotBefore(curve, p);
  if (i < 0) return curve.values[0];
  if (i + 1 >= curve.count) return curve.values[i];
  const float t = (p - curve.positions[i]) / (curve.positions[i + 1] - curve.positions[i]);
  return between(curve.values[i], curve.values[i + 1], t);
}

SCOLOPAX_HD inline float curvePosition(const ChannelView& channel, float stored) {
  const float p = clamp((stored - channel.origin) * channel.scale + channel.offset, 0.0f, 1.0f);
  return channel.gamma == 1.0f ? p : power(p, channel.gamma);
}

/// Limit of positions outside [0,1], which occur where the scalar is taken to be linear on a segment.
inline constexpr float kFarPosition = 1e6f;

/// Extinction per world unit at a curve position.
SCOLOPAX_HD inline float extinctionAt(const ChannelView& channel, float position) {
  return evaluate(channel.opacity, position) * channel.density;
}

/// Largest value of the curve between positions a and b, in either order.
SCOLOPAX_HD inline float largestBetween(const CurveView<float>& curve, float a, float b) {
  if (a > b) {
    const float other = a;
    a = b;
    b = other;
  }
  float largest = maximum(evaluate(curve, a), evaluate(curve, b));
  // Knots inside, and both sides of a jump at either end.
  for (int i = knotBefore(curve, a) + 1; i < curve.count && curve.positions[i] <= b; ++i)
    largest = maximum(largest, curve.values[i]);
  return largest;
}

/// Largest extinction over the stored values from lo to hi, lo <= hi, where the gradient factor is 1.
SCOLOPAX_HD inline float largestExtinction(const ChannelView& channel, float lo, float hi) {
  float a = curvePosition(channel, lo), b = curvePosition(channel, hi);
  if (channel.gamma != 1.0f) {  // the power function is within 2e-6 of monotone
    const float least = minimum(a, b), most = maximum(a, b);
    a = clamp(least * (1.0f - 4e-6f), 0.0f, 1.0f);
    b = clamp(most * (1.0f + 4e-6f), 0.0f, 1.0f);
  }
  return largestBetween(channel.opacity, a, b) * channel.density;
}

}  // namespace scolopax::kernel
