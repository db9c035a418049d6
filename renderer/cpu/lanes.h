// SPDX-License-Identifier: Apache-2.0
// The parts of lane types that are the same for all instruction sets. Included by lanes_*.h. Functions that
// are not inlined (SCOLOPAX_LANES_APART) take and return lanes in memory: GCC 12 may clear the upper halves
// of registers before they return.
#pragma once
#include <bit>
#include <glm/vec3.hpp>

namespace scolopax::SCOLOPAX_SIMD_SPACE {

SCOLOPAX_LANES Mask operator>(Float a, Float b) { return b < a; }
SCOLOPAX_LANES Mask operator>=(Float a, Float b) { return b <= a; }
SCOLOPAX_LANES Float operator-(Float x) { return floatOf(bitsOf(x) ^ 0x80000000u); }
SCOLOPAX_LANES std::int32_t at(Int a, int lane) { return firstOf(permuted(a, lane)); }
SCOLOPAX_LANES float at(Float a, int lane) { return firstOf(permuted(a, lane)); }
SCOLOPAX_LANES Int firstIn(Mask m, Int a) { return permuted(a, std::countr_zero(bitsOf(m))); }
SCOLOPAX_LANES void put(std::int32_t x, int lane, Int* to) { reinterpret_cast<std::int32_t*>(to)[lane] = x; }
SCOLOPAX_LANES void put(float x, int lane, Float* to) { reinterpret_cast<float*>(to)[lane] = x; }
/// NaN becomes lo; lo <= hi.
SCOLOPAX_LANES Float clamp(Float x, Float lo, Float hi) { return minimum(maximum(x, lo), hi); }
SCOLOPAX_LANES Mask isFinite(Float x) {
  const Int exponent = 0x7f800000;
  return without(everywhere(), (bitsOf(x) & exponent) == exponent);
}
/// Both halves are exact, so their sum is rounded as the number itself would be.
SCOLOPAX_LANES Float floatOfWord(Int k) { return toFloat(right<16>(k)) * 65536.0f + toFloat(k & 0xffff); }
SCOLOPAX_LANES Int gather(const std::uint32_t* base, Int index) { return gatherWords<4>(base, index); }
SCOLOPAX_LANES Int gather(const std::uint16_t* base, Int index) {
  return gatherWords<2>(base, index) & 0xffff;
}

struct Vec {
  Float x[3];
  Vec() = default;
  SCOLOPAX_LANES Vec(Float a, Float b, Float c) : x{a, b, c} {}
  SCOLOPAX_LANES explicit Vec(float a) : x{a, a, a} {}
  SCOLOPAX_LANES explicit Vec(const glm::vec3& v) : x{v.x, v.y, v.z} {}
  SCOLOPAX_LANES Float& operator[](int i) { return x[i]; }
  SCOLOPAX_LANES const Float& operator[](int i) const { return x[i]; }
};
SCOLOPAX_LANES Vec operator+(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
SCOLOPAX_LANES Vec operator-(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
SCOLOPAX_LANES Vec operator*(const Vec& a, const Vec& b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }
SCOLOPAX_LANES Vec operator*(const Vec& a, Float b) { return {a[0] * b, a[1] * b, a[2] * b}; }
SCOLOPAX_LANES Vec operator*(Float a, const Vec& b) { return b * a; }
SCOLOPAX_LANES Vec operator-(const Vec& a) { return {-a[0], -a[1], -a[2]}; }
SCOLOPAX_LANES Vec select(Mask m, const Vec& a, const Vec& b) {
  return {select(m, a[0], b[0]), select(m, a[1], b[1]), select(m, a[2], b[2])};
}

/// The lane type of this instruction set.
struct Lanes {
  static constexpr int kLanes = SCOLOPAX_SIMD_SPACE::kLanes;
  using Float = SCOLOPAX_SIMD_SPACE::Float;
  using Int = SCOLOPAX_SIMD_SPACE::Int;
  using Word = SCOLOPAX_SIMD_SPACE::Int;
  using Mask = SCOLOPAX_SIMD_SPACE::Mask;
  using Vec = SCOLOPAX_SIMD_SPACE::Vec;
  SCOLOPAX_LANES static Mask everywhere() { return SCOLOPAX_SIMD_SPACE::everywhere(); }
  SCOLOPAX_LANES static Int laneNumbers() { return SCOLOPAX_SIMD_SPACE::laneNumbers(); }
};

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
