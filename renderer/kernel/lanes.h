// SPDX-License-Identifier: Apache-2.0
// Lane types: each holds as many numbers as its instruction set has lanes. Kernels are templates over a lane
// type, and a lane computes the same bits with every one of them. This file lists the functions that lane
// types share and defines them for `One`, the type with a single lane.
#pragma once
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>

#include "renderer/kernel/portable.h"

// A lane type L has kLanes, Float, Int (32 bits), Word (32 bits, unsigned; where it is compared or converted,
// its highest bit is 0), Mask (all bits of a lane are set, or none), Vec (three Floats), everywhere() (the
// mask of all lanes) and laneNumbers() (0, 1, 2, ...). With one lane, `if (any(mask))` is a plain `if`.
// Besides arithmetic there are:
// - without(a, b): a and not b;
// - select(m, a, b): a where m is set, else b; where(m, a): select(m, a, 0); onesOf(m): select(m, 1, 0);
// - bitsOf(mask): bit i is lane i; bitsOf(a), floatOf(a): the same bits as another type;
// - left<bits>, right<bits>, rightSigned<bits>: shifts; right is logical, rightSigned arithmetic;
// - permuted(a, index): lane index[i] of a in lane i; firstIn(m, a): the value in the first lane of m, in all
//   lanes;
// - at(a, i): lane i of a; put(x, i, p): sets lane i of *p, in memory;
// - minimum(a, b), maximum(a, b): b where either is NaN; every comparison with NaN is false;
// - gather(base, i): base[i]; for 16-bit numbers it may read two bytes past the element;
// - truncated, toFloat: conversions between Float and Int; floatOfWord: converts all 32 bits as unsigned.
namespace scolopax::kernel {

inline constexpr float kInfinity = __builtin_huge_valf();
inline constexpr float kNaN = __builtin_nanf("");
inline constexpr float kLargestFinite = 0x1.fffffep127f;
inline constexpr float kLeastNormal = 0x1p-126f;

/// A single lane, in plain C++ for host and device.
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
SCOLOPAX_HD inline std::uint32_t unionOf(std::uint32_t a) { return a; }
/// Index of the lowest bit of a word that is set; the word must not be 0.
SCOLOPAX_HD inline int lowestBit(std::uint32_t word) {
#if defined(__CUDA_ARCH__)
  // nvcc 13 takes std::countr_zero() to be 31 on devices.
  return int(std::bit_cast<std::uint32_t>(float(word & (0u - word))) >> 23) - 127;
#else
  return std::countr_zero(word);
#endif
}
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

/// Lanes in which bit n of the word is set.
template <class Word>
SCOLOPAX_LANES auto hasBit(Word word, int n) {
  const Word bit(1u << n);
  return (word & bit) == bit;
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
