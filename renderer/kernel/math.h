// SPDX-License-Identifier: Apache-2.0
// The functions that kernels may call: built from IEEE operations alone, so that g++, clang, nvcc and
// every instruction set give the same bits. No std:: math, no contraction.
#pragma once
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>

#include "renderer/kernel/portable.h"

namespace scolopax::kernel {

inline constexpr float kInfinity = __builtin_huge_valf();
inline constexpr float kLargestFinite = 0x1.fffffep127f;
inline constexpr float kLeastNormal = 0x1p-126f;

SCOLOPAX_HD inline float squareRoot(float x) { return __builtin_sqrtf(x); }
SCOLOPAX_HD inline float minimum(float a, float b) { return a < b ? a : b; }
SCOLOPAX_HD inline float maximum(float a, float b) { return a > b ? a : b; }
SCOLOPAX_HD inline float magnitude(float x) { return maximum(x, -x); }
/// NaN becomes lo.
SCOLOPAX_HD inline float clamp(float x, float lo, float hi) { return x > lo ? (x < hi ? x : hi) : lo; }
SCOLOPAX_HD inline int clampInt(int x, int lo, int hi) { return x < lo ? lo : (x > hi ? hi : x); }
SCOLOPAX_HD inline bool isFinite(float x) {
  return (std::bit_cast<std::uint32_t>(x) & 0x7f800000u) != 0x7f800000u;
}

namespace detail {
/// Splits x > 0, normal, into m * 2^e with m in [sqrt(1/2), sqrt(2)).
struct Exponent {
  float mantissa;
  float exponent;
};
SCOLOPAX_HD inline Exponent splitExponent(float x) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  // Subtracting the bits of sqrt(1/2) makes the carry into the exponent field do the rounding.
  const std::uint32_t shifted = bits - 0x3f3504f3u;
  const std::int32_t e = std::int32_t(shifted) >> 23;
  return {std::bit_cast<float>(bits - (std::uint32_t(e) << 23)), float(e)};
}
/// log(1 + f), 1 + f in [sqrt(1/2), sqrt(2)): 2 artanh(s), s = f / (2 + f), |s| < 0.1716. The series is cut
/// where its next term is below 2e-9 of the result.
SCOLOPAX_HD inline float log1pReduced(float f) {
  const float s = f / (2.0f + f);
  const float s2 = s * s;
  const float series =
      s2 * (0.333333333f + s2 * (0.2f + s2 * (0.142857143f + s2 * (0.111111111f + s2 * 0.0909090909f))));
  // f - s * (f - 2 series): keeps the leading term exact, as the textbook form does.
  return f - s * (f - 2.0f * series);
}
}  // namespace detail

/// -log(1 - u) for u in (0, 1): the optical depth of a free flight (Eq. 3). Within 2 ulp, also for tiny u,
/// where a plain logarithm of the rounded 1 - u would lose everything.
SCOLOPAX_HD inline float opticalDepth(float u) {
  const float w = 1.0f - u;
  const float lost = (1.0f - w) - u;  // w + lost == 1 - u exactly
  const auto [m, e] = detail::splitExponent(w);
  const float correction = lost * (2.0f - w);  // lost / w, to first order in 1 - w
  const float low = e * 1.42860682e-6f;        // log(2) = a part of 15 bits, exact times e, + this
  return -(e * 0.693145752f + (detail::log1pReduced(m - 1.0f) + (low + correction)));
}

/// Base-2 logarithm of x > 0, normal.
SCOLOPAX_HD inline float log2Of(float x) {
  const auto [m, e] = detail::splitExponent(x);
  return e + detail::log1pReduced(m - 1.0f) * 1.44269504f;
}

/// 2^x; 0 below -126, infinity from 128 on.
SCOLOPAX_HD inline float exp2Of(float x) {
  if (!(x > -126.0f)) return 0.0f;
  if (x >= 128.0f) return kInfinity;
  const int whole = int(x + (x < 0.0f ? -0.5f : 0.5f));
  const float r = (x - float(whole)) * 0.693147181f;  // |r| <= 0.3466
  const float p =
      1.0f +
      r * (1.0f + r * (0.5f + r * (0.166666667f +
                                   r * (0.0416666667f +
                                        r * (0.00833333333f + r * (0.00138888889f + r * 0.000198412698f))))));
  const int half = whole / 2;  // two steps: 2^whole itself may be out of range
  const float a = std::bit_cast<float>(std::uint32_t(half + 127) << 23);
  const float b = std::bit_cast<float>(std::uint32_t(whole - half + 127) << 23);
  return p * a * b;
}

/// 1 - exp(-depth) for depth >= 0: what a stretch of that optical depth absorbs. By its series where the
/// difference from 1 would lose digits.
SCOLOPAX_HD inline float absorbed(float depth) {
  if (depth < 0.25f)
    return depth *
           (1.0f - depth * (0.5f - depth * (0.166666667f -
                                            depth * (0.0416666667f -
                                                     depth * (0.00833333333f - depth * 0.00138888889f)))));
  return 1.0f - exp2Of(depth * -1.44269504f);
}

/// x^exponent for x in [0, 1] and exponent > 0.
SCOLOPAX_HD inline float power(float x, float exponent) {
  if (!(x > kLeastNormal)) return 0.0f;
  if (x >= 1.0f) return 1.0f;
  return minimum(exp2Of(exponent * log2Of(x)), 1.0f);
}

}  // namespace scolopax::kernel
