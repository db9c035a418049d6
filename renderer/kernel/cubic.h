// SPDX-License-Identifier: Apache-2.0
// A scalar along a ray inside one cell of eight voxels. Trilinear interpolation makes it a cubic there; this
// file finds where the cubic turns and where it takes a given value.
#pragma once
#include "renderer/kernel/math.h"

namespace scolopax::kernel {

/// c0 + y (c1 + y (c2 + y c3)), for y in [-1, 1].
template <class L>
struct Cubic {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  Float c0, c1, c2, c3;

  SCOLOPAX_LANES Float at(Float y) const { return c0 + y * (c1 + y * (c2 + y * c3)); }
  SCOLOPAX_LANES Float slopeAt(Float y) const { return c1 + y * (2.0f * c2 + y * (3.0f * c3)); }
};

template <class L>
SCOLOPAX_LANES Cubic<L> select(typename L::Mask m, const Cubic<L>& a, const Cubic<L>& b) {
  return {select(m, a.c0, b.c0), select(m, a.c1, b.c1), select(m, a.c2, b.c2), select(m, a.c3, b.c3)};
}

/// The part of a cubic from `middle` - `half` to `middle` + `half`, for y in [-1, 1].
template <class L>
SCOLOPAX_LANES Cubic<L> partOf(const Cubic<L>& f, typename L::Float middle, typename L::Float half) {
  // Not slopeAt(), as three times the largest coefficient may overflow.
  return {f.at(middle), half * (f.c1 + (2.0f * middle) * f.c2 + (3.0f * middle * middle) * f.c3),
          half * half * (f.c2 + 3.0f * middle * f.c3), half * half * half * f.c3};
}

/// Sample points of a cubic, strictly inside the interval: its ends lie on faces shared by two cells.
inline constexpr int kCubicNodes = 4;
SCOLOPAX_HD constexpr float cubicNode(int i) { return 0.5f * float(i) - 0.75f; }

/// The cubic with the given values at the nodes.
template <class L>
SCOLOPAX_LANES Cubic<L> cubicThrough(const typename L::Float* values) {
  using Float = typename L::Float;
  const Float outer = 0.5f * (values[0] + values[3]), inner = 0.5f * (values[1] + values[2]);
  const Float outerSlope = 0.5f * (values[3] - values[0]), innerSlope = 0.5f * (values[2] - values[1]);
  const Float c2 = 2.0f * (outer - inner), c3 = 2.66666667f * (outerSlope - 3.0f * innerSlope);
  return {inner - 0.0625f * c2, 4.0f * innerSlope - 0.0625f * c3, c2, c3};
}

/// Bounds over [-1, 1]: the smallest and the largest Bernstein coefficient.
template <class L>
struct CubicBounds {
  typename L::Float lower, upper;
};
template <class L>
SCOLOPAX_LANES CubicBounds<L> boundsOf(const Cubic<L>& f) {
  using Float = typename L::Float;
  const Float even = f.c0 + f.c2, odd = f.c1 + f.c3;
  const Float first = even - odd, last = even + odd;
  const Float middle = f.c0 - 0.333333333f * f.c2, slope = 0.333333333f * f.c1 - f.c3;
  const Float second = middle - slope, third = middle + slope;
  return {minimum(minimum(first, second), minimum(third, last)),
          maximum(maximum(first, second), maximum(third, last))};
}

/// Where the cubic turns inside (-1, 1), in order; 1 where it does not.
template <class L>
struct Turns {
  typename L::Float first, second;
};
template <class L>
SCOLOPAX_LANES Turns<L> turnsOf(const Cubic<L>& f) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  // Roots of a y^2 + 2 b y + c, without cancellation.
  // Divided by the largest coefficient, as squares of it may overflow or underflow.
  const Float largest = maximum(magnitude(f.c1), maximum(magnitude(f.c2), magnitude(f.c3)));
  const Float scale = 1.0f / maximum(largest, Float(kLeastNormal));
  const Float a = 3.0f * (f.c3 * scale), b = f.c2 * scale, c = f.c1 * scale;
  const Float discriminant = b * b - a * c;
  const Float root = squareRoot(maximum(discriminant, 0.0f));
  const Float sum = -(b + select(b < 0.0f, -root, root));
  const Float x = sum / a, y = c / sum;
  const Mask real = discriminant > 0.0f;
  const Float one(1.0f);
  const Float p = select(real & (x > -1.0f) & (x < 1.0f), x, one);
  const Float q = select(real & (y > -1.0f) & (y < 1.0f), y, one);
  return {minimum(p, q), maximum(p, q)};
}

/// Where the cubic, which is monotone from `begin` to `end`, takes `value`, which lies between its values
/// there. For lanes in `which`. Newton's method, kept inside a bracket; near a turn it converges slowly.
template <class L>
SCOLOPAX_LANES typename L::Float crossing(const Cubic<L>& f, typename L::Float begin, typename L::Float end,
                                          typename L::Float atBegin, typename L::Float atEnd,
                                          typename L::Float value, typename L::Mask which) {
  using Float = typename L::Float;
  using Mask = typename L::Mask;
  constexpr int kMostSteps = 24;
  constexpr float kClose = 0x1p-22f;
  const Mask rising = atBegin < atEnd;
  Float low = begin, high = end;
  Float y = begin + (end - begin) * clamp((value - atBegin) / (atEnd - atBegin), 0.0f, 1.0f);
  Mask moving = which;
  for (int i = 0; i < kMostSteps && any(moving); ++i) {
    const Float off = f.at(y) - value;
    const Mask ahead = select(rising, -off, off) > 0.0f;  // the crossing is further on
    low = select(ahead, y, low);
    high = select(ahead, high, y);
    const Float step = off / f.slopeAt(y), newton = y - step;
    const Mask inside = (newton >= low) & (newton <= high);  // false for NaN
    const Float next = select(inside, newton, 0.5f * (low + high));
    const Mask far = maximum(next - y, y - next) > kClose;
    y = select(moving, next, y);
    moving = moving & far;
  }
  return clamp(y, begin, end);
}

}  // namespace scolopax::kernel
