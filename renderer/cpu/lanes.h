// SPDX-License-Identifier: Apache-2.0
// As many numbers at once as an instruction set has lanes, each with the meaning, to the last bit, that
// kernel/math.h gives to one: AVX-512 in files that define SCOLOPAX_SIMD_AVX512 before they include this,
// AVX2 in others. What is built of it lies in a namespace of the set's own.
#pragma once
#if defined(__x86_64__)
#include <immintrin.h>

#include <cstdint>

#include "renderer/kernel/math.h"
// What there is for each: Mask (all of a lane, or nothing), Int, Float, and
//   maskOf(bits)        and bitsOf(mask): bit i is lane i
//   without(a, b)       a, but not where b is
//   select(m, a, b)     a where the mask is set, else b; where(m, a) with b = 0; onesOf(m) with a = 1, b = 0
//   left, right<bits>   shifts, right of a number without sign; rightSigned
//   permuted(a, index)  lane index[i] of a in lane i
//   minimum(a, b)       b where either is NaN; comparisons with NaN are false
//   looked(table, i)    entries of every byte; bytesReversed(a) of every lane
//   gather(base, i)     base[i]; gatherWords<scale>(base, i): four bytes from base + scale * i
//
// Functions, not files, have the instruction set: an inline function of a header that a file compiled for
// AVX2 might be the one that the linker keeps for everybody.
#if defined(SCOLOPAX_SIMD_AVX512)
#include "renderer/cpu/lanes_avx512.h"
#else
#include "renderer/cpu/lanes_avx2.h"
#endif

namespace scolopax::SCOLOPAX_SIMD_SPACE {

SCOLOPAX_SIMD Mask operator>(Float a, Float b) { return b < a; }
SCOLOPAX_SIMD Mask operator>=(Float a, Float b) { return b <= a; }
/// One lane.
SCOLOPAX_SIMD std::int32_t at(Int a, int lane) { return firstOf(permuted(a, ints(lane))); }
SCOLOPAX_SIMD float at(Float a, int lane) { return firstOf(permuted(a, ints(lane))); }
SCOLOPAX_SIMD void put(float x, int lane, Float* to) {
  *to = select(laneNumbers() == ints(lane), floats(x), *to);
}
/// NaN becomes lo; lo <= hi.
SCOLOPAX_SIMD Float clamp(Float x, Float lo, Float hi) { return minimum(maximum(x, lo), hi); }
SCOLOPAX_SIMD Float negative(Float x) { return floatOf(bitsOf(x) ^ ints(int(0x80000000u))); }
SCOLOPAX_SIMD Mask isFinite(Float x) {
  const Int exponent = ints(0x7f800000);
  return without(everywhere(), (bitsOf(x) & exponent) == exponent);
}
SCOLOPAX_SIMD Int gather(const std::uint32_t* base, Int index) { return gatherWords<4>(base, index); }
/// Reads two bytes more.
SCOLOPAX_SIMD Int gather(const std::uint16_t* base, Int index) {
  return gatherWords<2>(base, index) & ints(0xffff);
}

/// kernel::exp2Of of numbers below 128.
SCOLOPAX_SIMD Float exp2Of(Float x) {
  const Float half = select(x < floats(0.0f), floats(-0.5f), floats(0.5f));
  const Int whole = truncated(x + half);
  const Float r = (x - toFloat(whole)) * floats(0.693147181f);
  const Float p =
      floats(1.0f) +
      r * (floats(1.0f) +
           r * (floats(0.5f) + r * (floats(0.166666667f) +
                                    r * (floats(0.0416666667f) +
                                         r * (floats(0.00833333333f) +
                                              r * (floats(0.00138888889f) + r * floats(0.000198412698f)))))));
  const Int first = rightSigned<1>(whole + right<31>(whole)), bias = ints(127);  // rounds towards 0
  const Float a = floatOf(left<23>(first + bias));
  const Float b = floatOf(left<23>(whole - first + bias));
  return where(x > floats(-126.0f), p * a * b);
}

/// kernel::log2Of of numbers above 0, normal.
SCOLOPAX_SIMD Float log2Of(Float x) {
  const Int bits = bitsOf(x);
  const Int exponent = rightSigned<23>(bits - ints(0x3f3504f3));
  const Float f = floatOf(bits - left<23>(exponent)) - floats(1.0f);
  const Float s = f / (floats(2.0f) + f), s2 = s * s;
  const Float series =
      s2 * (floats(0.333333333f) +
            s2 * (floats(0.2f) +
                  s2 * (floats(0.142857143f) + s2 * (floats(0.111111111f) + s2 * floats(0.0909090909f)))));
  return toFloat(exponent) + (f - s * (f - floats(2.0f) * series)) * floats(1.44269504f);
}

/// kernel::power of x in [0, 1].
SCOLOPAX_SIMD Float power(Float x, Float exponent) {
  const Float one = floats(1.0f);
  const Mask some = x > floats(kernel::kLeastNormal), whole = x >= one;
  const Float inner = select(without(some, whole), x, floats(0.5f));
  const Float result = minimum(exp2Of(exponent * log2Of(inner)), one);
  return where(some, select(whole, one, result));
}

/// kernel::absorbed.
SCOLOPAX_SIMD Float absorbed(Float depth) {
  const Float one = floats(1.0f);
  const Float series =
      depth *
      (one - depth * (floats(0.5f) -
                      depth * (floats(0.166666667f) -
                               depth * (floats(0.0416666667f) -
                                        depth * (floats(0.00833333333f) - depth * floats(0.00138888889f))))));
  const Mask thin = depth < floats(0.25f);
  if (!any(without(everywhere(), thin))) return series;
  return select(thin, series, one - exp2Of(depth * floats(-1.44269504f)));
}

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
