// SPDX-License-Identifier: Apache-2.0
// The mathematical functions for kernels: built from IEEE operations alone, so that g++, clang, nvcc and
// every instruction set give the same bits. No std:: math, no contraction.
#pragma once
#include <type_traits>

#include "renderer/kernel/lanes.h"

namespace scolopax::kernel {

template <class Float>
SCOLOPAX_LANES Float magnitude(Float x) {
  return maximum(x, -x);
}
template <class Vec>
SCOLOPAX_LANES auto sumOfMagnitudes(const Vec& v) {
  return magnitude(v[0]) + magnitude(v[1]) + magnitude(v[2]);
}
SCOLOPAX_HD inline int clampInt(int x, int lo, int hi) { return x < lo ? lo : (x > hi ? hi : x); }

namespace detail {
/// Splits a normal x > 0 into m * 2^e with m in [sqrt(1/2), sqrt(2)).
template <class Float>
struct Exponent {
  Float mantissa, exponent;
};
template <class Float>
SCOLOPAX_LANES Exponent<Float> splitExponent(Float x) {
  // Subtracting the bits of sqrt(1/2) makes the carry into the exponent field do the rounding.
  const auto bits = bitsOf(x), e = rightSigned<23>(bits - 0x3f3504f3);
  return {floatOf(bits - left<23>(e)), toFloat(e)};
}
/// log(1 + f) for 1 + f in [sqrt(1/2), sqrt(2)): 2 artanh(s), s = f / (2 + f), |s| < 0.1716. The series is
/// truncated where its next term is below 2e-9 of the result.
template <class Float>
SCOLOPAX_LANES Float log1pReduced(Float f) {
  const Float s = f / (2.0f + f);
  const Float s2 = s * s;
  const Float series =
      s2 * (0.333333333f + s2 * (0.2f + s2 * (0.142857143f + s2 * (0.111111111f + s2 * 0.0909090909f))));
  // f - s * (f - 2 series): keeps the leading term exact, as the textbook form does.
  return f - s * (f - 2.0f * series);
}
}  // namespace detail

/// -log(1 - u) for u in (0, 1): the optical depth of a free flight (Eq. 3). Accurate to 2 ulp even for tiny
/// u, where the logarithm of the rounded 1 - u would lose all digits.
template <class Float>
SCOLOPAX_LANES Float opticalDepth(Float u) {
  const Float w = 1.0f - u;
  const Float lost = (1.0f - w) - u;  // w + lost == 1 - u exactly
  const detail::Exponent<Float> of = detail::splitExponent(w);
  const Float correction = lost * (2.0f - w);      // lost / w, to first order in 1 - w
  const Float low = of.exponent * 1.42860682e-6f;  // log(2) = 15 bits, whose product with e is exact, + this
  return -(of.exponent * 0.693145752f + (detail::log1pReduced(of.mantissa - 1.0f) + (low + correction)));
}

/// Base-2 logarithm of a normal x > 0.
template <class Float>
SCOLOPAX_LANES Float log2Of(Float x) {
  const detail::Exponent<Float> of = detail::splitExponent(x);
  return of.exponent + detail::log1pReduced(of.mantissa - 1.0f) * 1.44269504f;
}

/// 2^x for x < 128; 0 for x <= -126.
template <class Float>
SCOLOPAX_LANES Float exp2Of(Float x) {
  const auto some = x > -126.0f;
  x = select(some, x, -126.0f);
  const auto whole = truncated(x + select(x < 0.0f, Float(-0.5f), Float(0.5f)));
  const Float r = (x - toFloat(whole)) * 0.693147181f;  // |r| <= 0.3466
  const Float p =
      1.0f +
      r * (1.0f + r * (0.5f + r * (0.166666667f +
                                   r * (0.0416666667f +
                                        r * (0.00833333333f + r * (0.00138888889f + r * 0.000198412698f))))));
  const auto half = rightSigned<1>(whole + right<31>(whole));  // two factors: 2^whole may be out of range
  return where(some, p * floatOf(left<23>(half + 127)) * floatOf(left<23>(whole - half + 127)));
}

/// 1 - exp(-depth) for depth >= 0: the fraction of light that this optical depth absorbs. For small depths by
/// its series, as the difference from 1 would lose digits.
template <class Float>
SCOLOPAX_LANES Float absorbed(Float depth) {
  const auto thick = depth >= 0.25f;
  const Float series =
      depth * (1.0f - depth * (0.5f - depth * (0.166666667f -
                                               depth * (0.0416666667f -
                                                        depth * (0.00833333333f - depth * 0.00138888889f)))));
  if (!any(thick)) return series;
  return select(thick, 1.0f - exp2Of(depth * -1.44269504f), series);
}

/// x^exponent for x in [0, 1] and exponent > 0.
template <class Float>
SCOLOPAX_LANES Float power(Float x, std::type_identity_t<Float> exponent) {
  const auto whole = x >= 1.0f, some = x > kLeastNormal;
  if (!any(some)) return Float(0.0f);
  const Float inner = select(without(some, whole), x, Float(0.5f));
  return where(some, select(whole, Float(1.0f), minimum(exp2Of(exponent * log2Of(inner)), 1.0f)));
}

}  // namespace scolopax::kernel
