// SPDX-License-Identifier: Apache-2.0
// Lane types: as many numbers at once as an instruction set has lanes. Kernels are templates over them and
// give every lane the same bits; here are the functions they share, for the lane type of one number.
#pragma once
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>

#include "renderer/kernel/portable.h"

// A lane type L has kLanes, Float, Int (32 bits), Word (the same without a sign; where it is compared or
// converted its highest bit is 0), Mask (all of a lane, or nothing), Vec (three Floats), everywhere() and
// laneNumbers(). `if (any(mask))` is a plain `if` where there is one lane. Beside arithmetic there are:
// - without(a, b): a, but not where b is set;
// - select(m, a, b): a where m is set, else b; where(m, a): with b = 0; onesOf(m): with a = 1 and b = 0;
// - bitsOf(mask): bit i is lane i; bitsOf(a), floatOf(a): the same bits as another type;
// - left<bits>, right<bits>, rightSigned<bits>: shifts, of which right takes a number without a sign;
// - permuted(a, index): lane index[i] of a in lane i; firstIn(m, a): that of the first lane in the mask;
// - at(a, i), put(x, i, p): one lane, p in memory;
// - minimum(a, b), maximum(a, b): b where either is NaN, with which every comparison is false;
// - gather(base, i): base[i]; of 16-bit numbers it may read two bytes more;
// - truncated, toFloat: conversions; floatOfWord: of all 32 bits.
namespace scolopax::kernel {

inline constexpr float kInfinity = __builtin_huge_valf();
inline constexpr float kNaN = __builtin_nanf("");
inline constexpr float kLargestFinite = 0x1.fffffep127f;
inline constexpr float kLeastNormal = 0x1p-126f;

/// One number: what host and device have without more.
struct One {
  static constexpr int kLanes = 1;
  using Float = float;
  using Int = std::int32_t;
  using Word = std::uint32_t;
  using Mask = bool;
  using Vec = glm::vec3;
  SCOLOPAX_HD static Mask everywhere() { return true; }
  SCOLOPAX_HD static Int laneNumbers() { return 0; }
};

SCOLOPAX_HD inline bool any(bool m) { return m; }
SCOLOPAX_HD inline unsigned bitsOf(bool m) { return m ? 1 : 0; }
SCOLOPAX_HD inline bool without(bool a, bool b) { return a && !b; }
SCOLOPAX_HD inline float select(bool m, float a, float b) { return m ? a : b; }
SCOLOPAX_HD inline std::int32_t select(bool m, std::int32_t a, std::int32_t b) { return m ? a : b; }
SCOLOPAX_HD inline std::uint32_t select(bool m, std::uint32_t a, std::uint32_t b) { return m ? a : b; }
SCOLOPAX_HD inline glm::vec3 select(bool m, glm::vec3 a, glm::vec3 b) { return m ? a : b; }
SCOLOPAX_HD inline float where(bool m, float a) { return m ? a : 0.0f; }
SCOLOPAX_HD inline std::int32_t where(bool m, std::int32_t a) { return m ? a : 0; }
SCOLOPAX_HD inline std::uint32_t where(bool m, std::uint32_t a) { return m ? a : 0u; }
SCOLOPAX_HD inline std::int32_t onesOf(bool m) { return m ? 1 : 0; }
template <class Number>
SCOLOPAX_HD inline Number firstIn(bool, Number a) {
  return a;
}
template <class Number>
SCOLOPAX_HD inline Number at(Number a, int) {
  return a;
}

SCOLOPAX_HD inline float squareRoot(float x) { return __builtin_sqrtf(x); }
SCOLOPAX_HD inline float minimum(float a, float b) { return a < b ? a : b; }
SCOLOPAX_HD inline float maximum(float a, float b) { return a > b ? a : b; }
SCOLOPAX_HD inline std::int32_t minimum(std::int32_t a, std::int32_t b) { return a < b ? a : b; }
SCOLOPAX_HD inline std::int32_t maximum(std::int32_t a, std::int32_t b) { return a > b ? a : b; }
SCOLOPAX_HD inline std::uint32_t minimum(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }
SCOLOPAX_HD inline std::uint32_t maximum(std::uint32_t a, std::uint32_t b) { return a > b ? a : b; }
/// NaN becomes lo.
SCOLOPAX_HD inline float clamp(float x, float lo, float hi) { return x > lo ? (x < hi ? x : hi) : lo; }
SCOLOPAX_HD inline bool isFinite(float x) {
  return (std::bit_cast<std::uint32_t>(x) & 0x7f800000u) != 0x7f800000u;
}

template <int kBits>
SCOLOPAX_HD inline std::int32_t left(std::int32_t a) {
  return a << kBits;
}
template <int kBits>
SCOLOPAX_HD inline std::uint32_t left(std::uint32_t a) {
  return a << kBits;
}
template <int kBits>
SCOLOPAX_HD inline std::uint32_t right(std::uint32_t a) {
  return a >> kBits;
}
template <int kBits>
SCOLOPAX_HD inline std::int32_t right(std::int32_t a) {
  return std::int32_t(std::uint32_t(a) >> kBits);
}
template <int kBits>
SCOLOPAX_HD inline std::int32_t rightSigned(std::int32_t a) {
  return a >> kBits;
}
SCOLOPAX_HD inline std::int32_t truncated(float x) { return std::int32_t(x); }
SCOLOPAX_HD inline float toFloat(std::int32_t x) { return float(x); }
SCOLOPAX_HD inline float floatOfWord(std::uint32_t x) { return float(x); }
SCOLOPAX_HD inline std::int32_t bitsOf(float x) { return std::bit_cast<std::int32_t>(x); }
SCOLOPAX_HD inline float floatOf(std::int32_t bits) { return std::bit_cast<float>(bits); }
template <class Value>
SCOLOPAX_HD inline Value gather(const Value* base, std::int32_t index) {
  return base[index];
}
template <class Value>
SCOLOPAX_HD inline Value gather(const Value* base, std::uint32_t index) {
  return base[index];
}

template <class Vec>
SCOLOPAX_LANES auto dot(const Vec& a, const Vec& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class Vec>
SCOLOPAX_LANES Vec normalize(const Vec& v) {
  const auto lengthSquared = dot(v, v);
  return select(lengthSquared > 0.0f, v * (1.0f / squareRoot(lengthSquared)), v);
}

}  // namespace scolopax::kernel
