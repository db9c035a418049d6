// SPDX-License-Identifier: Apache-2.0
// Eight numbers at once in AVX2, with the meaning, to the last bit, that kernel/math.h gives to one.
// Functions, not files, have the instruction set: an inline function of a header that a file of its own
// compiled for AVX2 might be the one that the linker keeps for everybody.
#pragma once
#if defined(__x86_64__)
#include <immintrin.h>

#include <cstdint>

#include "renderer/kernel/math.h"

#define SCOLOPAX_AVX2_ONLY __attribute__((target("avx2")))
#define SCOLOPAX_AVX2 __attribute__((target("avx2"), always_inline)) inline

namespace scolopax::lanes {

inline constexpr int kLanes = 8;

/// All bits of a lane, or none.
struct Mask {
  __m256 v;
};
SCOLOPAX_AVX2 Mask operator&(Mask a, Mask b) { return {_mm256_and_ps(a.v, b.v)}; }
SCOLOPAX_AVX2 Mask operator|(Mask a, Mask b) { return {_mm256_or_ps(a.v, b.v)}; }
SCOLOPAX_AVX2 Mask without(Mask a, Mask b) { return {_mm256_andnot_ps(b.v, a.v)}; }
SCOLOPAX_AVX2 unsigned bitsOf(Mask a) { return unsigned(_mm256_movemask_ps(a.v)); }
SCOLOPAX_AVX2 bool any(Mask a) {
  return !_mm256_testz_si256(_mm256_castps_si256(a.v), _mm256_castps_si256(a.v));
}

struct Int {
  __m256i v;
};
SCOLOPAX_AVX2 Int ints(int x) { return {_mm256_set1_epi32(x)}; }
SCOLOPAX_AVX2 Int operator+(Int a, Int b) { return {_mm256_add_epi32(a.v, b.v)}; }
SCOLOPAX_AVX2 Int operator-(Int a, Int b) { return {_mm256_sub_epi32(a.v, b.v)}; }
SCOLOPAX_AVX2 Int operator*(Int a, Int b) { return {_mm256_mullo_epi32(a.v, b.v)}; }
SCOLOPAX_AVX2 Int operator&(Int a, Int b) { return {_mm256_and_si256(a.v, b.v)}; }
SCOLOPAX_AVX2 Int operator^(Int a, Int b) { return {_mm256_xor_si256(a.v, b.v)}; }
SCOLOPAX_AVX2 Int operator|(Int a, Int b) { return {_mm256_or_si256(a.v, b.v)}; }
template <int kBits>
SCOLOPAX_AVX2 Int left(Int a) {
  return {_mm256_slli_epi32(a.v, kBits)};
}
/// Towards the lowest bit: of a number without sign, and of one with it.
template <int kBits>
SCOLOPAX_AVX2 Int right(Int a) {
  return {_mm256_srli_epi32(a.v, kBits)};
}
template <int kBits>
SCOLOPAX_AVX2 Int rightSigned(Int a) {
  return {_mm256_srai_epi32(a.v, kBits)};
}
SCOLOPAX_AVX2 Int load(const std::int32_t* from) {
  return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from))};
}
SCOLOPAX_AVX2 Int minimum(Int a, Int b) { return {_mm256_min_epi32(a.v, b.v)}; }
SCOLOPAX_AVX2 Int maximum(Int a, Int b) { return {_mm256_max_epi32(a.v, b.v)}; }
SCOLOPAX_AVX2 Mask operator==(Int a, Int b) { return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(a.v, b.v))}; }
SCOLOPAX_AVX2 Mask operator>(Int a, Int b) { return {_mm256_castsi256_ps(_mm256_cmpgt_epi32(a.v, b.v))}; }
SCOLOPAX_AVX2 Int select(Mask m, Int a, Int b) {
  return {_mm256_blendv_epi8(b.v, a.v, _mm256_castps_si256(m.v))};
}
/// 1 where the mask is set, else 0.
SCOLOPAX_AVX2 Int onesOf(Mask m) { return {_mm256_srli_epi32(_mm256_castps_si256(m.v), 31)}; }
SCOLOPAX_AVX2 void store(Int a, std::int32_t* to) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), a.v);
}
/// Lane index[i] of a in lane i.
SCOLOPAX_AVX2 Int permuted(Int a, Int index) { return {_mm256_permutevar8x32_epi32(a.v, index.v)}; }
/// 0 to 7.
SCOLOPAX_AVX2 Int laneNumbers() { return {_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)}; }
/// One lane.
SCOLOPAX_AVX2 std::int32_t at(Int a, int lane) { return _mm256_cvtsi256_si32(permuted(a, ints(lane)).v); }
SCOLOPAX_AVX2 int largestOf(Int a) {
  const __m128i four = _mm_max_epi32(_mm256_castsi256_si128(a.v), _mm256_extracti128_si256(a.v, 1));
  const __m128i two = _mm_max_epi32(four, _mm_shuffle_epi32(four, 0x4e));
  return _mm_cvtsi128_si32(_mm_max_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}
SCOLOPAX_AVX2 unsigned unionOf(Int a) {
  const __m128i four = _mm_or_si128(_mm256_castsi256_si128(a.v), _mm256_extracti128_si256(a.v, 1));
  const __m128i two = _mm_or_si128(four, _mm_shuffle_epi32(four, 0x4e));
  return unsigned(_mm_cvtsi128_si32(_mm_or_si128(two, _mm_shuffle_epi32(two, 0xb1))));
}
SCOLOPAX_AVX2 int firstOf(Int a) { return _mm256_cvtsi256_si32(a.v); }

struct Float {
  __m256 v;
};
SCOLOPAX_AVX2 Float floats(float x) { return {_mm256_set1_ps(x)}; }
SCOLOPAX_AVX2 Float load(const float* from) { return {_mm256_loadu_ps(from)}; }
SCOLOPAX_AVX2 void store(Float a, float* to) { _mm256_storeu_ps(to, a.v); }
SCOLOPAX_AVX2 Float permuted(Float a, Int index) { return {_mm256_permutevar8x32_ps(a.v, index.v)}; }
SCOLOPAX_AVX2 float at(Float a, int lane) { return _mm256_cvtss_f32(permuted(a, ints(lane)).v); }
SCOLOPAX_AVX2 Float operator+(Float a, Float b) { return {_mm256_add_ps(a.v, b.v)}; }
SCOLOPAX_AVX2 Float operator-(Float a, Float b) { return {_mm256_sub_ps(a.v, b.v)}; }
SCOLOPAX_AVX2 Float operator*(Float a, Float b) { return {_mm256_mul_ps(a.v, b.v)}; }
SCOLOPAX_AVX2 Float operator/(Float a, Float b) { return {_mm256_div_ps(a.v, b.v)}; }
/// Every comparison with NaN is false.
SCOLOPAX_AVX2 Mask operator<(Float a, Float b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)}; }
SCOLOPAX_AVX2 Mask operator<=(Float a, Float b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)}; }
SCOLOPAX_AVX2 Mask operator>(Float a, Float b) { return b < a; }
SCOLOPAX_AVX2 Mask operator>=(Float a, Float b) { return b <= a; }
SCOLOPAX_AVX2 Mask operator==(Float a, Float b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_EQ_OQ)}; }
SCOLOPAX_AVX2 Float select(Mask m, Float a, Float b) { return {_mm256_blendv_ps(b.v, a.v, m.v)}; }
SCOLOPAX_AVX2 void put(float x, int lane, Float* to) {
  *to = select(laneNumbers() == ints(lane), floats(x), *to);
}
/// a where the mask is set, else 0.
SCOLOPAX_AVX2 Int where(Mask m, Int a) { return {_mm256_and_si256(_mm256_castps_si256(m.v), a.v)}; }
SCOLOPAX_AVX2 Float where(Mask m, Float a) { return {_mm256_and_ps(m.v, a.v)}; }
SCOLOPAX_AVX2 Float minimum(Float a, Float b) { return {_mm256_min_ps(a.v, b.v)}; }
SCOLOPAX_AVX2 Float maximum(Float a, Float b) { return {_mm256_max_ps(a.v, b.v)}; }
/// NaN becomes lo; lo <= hi.
SCOLOPAX_AVX2 Float clamp(Float x, Float lo, Float hi) { return minimum(maximum(x, lo), hi); }
SCOLOPAX_AVX2 Float negative(Float x) { return {_mm256_xor_ps(x.v, _mm256_set1_ps(-0.0f))}; }
SCOLOPAX_AVX2 Float squareRoot(Float x) { return {_mm256_sqrt_ps(x.v)}; }
SCOLOPAX_AVX2 Int truncated(Float x) { return {_mm256_cvttps_epi32(x.v)}; }
SCOLOPAX_AVX2 Float toFloat(Int x) { return {_mm256_cvtepi32_ps(x.v)}; }
SCOLOPAX_AVX2 Mask isFinite(Float x) {
  const Int exponent = ints(0x7f800000);
  const Int bits{_mm256_castps_si256(x.v)};
  return without({_mm256_castsi256_ps(_mm256_set1_epi32(-1))}, (bits & exponent) == exponent);
}
SCOLOPAX_AVX2 float smallestOf(Float x) {
  const __m128 four = _mm_min_ps(_mm256_castps256_ps128(x.v), _mm256_extractf128_ps(x.v, 1));
  const __m128 two = _mm_min_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps(two, two, 1)));
}

/// base[index] of every lane.
SCOLOPAX_AVX2 Float gather(const float* base, Int index) { return {_mm256_i32gather_ps(base, index.v, 4)}; }
SCOLOPAX_AVX2 Int gather(const std::uint32_t* base, Int index) {
  return {_mm256_i32gather_epi32(reinterpret_cast<const int*>(base), index.v, 4)};
}
/// The same; reads two bytes more.
SCOLOPAX_AVX2 Int gather(const std::uint16_t* base, Int index) {
  const __m256i words = _mm256_i32gather_epi32(reinterpret_cast<const int*>(base), index.v, 2);
  return {_mm256_and_si256(words, _mm256_set1_epi32(0xffff))};
}

/// kernel::exp2Of of numbers below 128.
SCOLOPAX_AVX2 Float exp2Of(Float x) {
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
  const Float a{_mm256_castsi256_ps(left<23>(first + bias).v)};
  const Float b{_mm256_castsi256_ps(left<23>(whole - first + bias).v)};
  return where(x > floats(-126.0f), p * a * b);
}

/// kernel::log2Of of numbers above 0, normal.
SCOLOPAX_AVX2 Float log2Of(Float x) {
  const Int bits{_mm256_castps_si256(x.v)};
  const Int exponent = rightSigned<23>(bits - ints(0x3f3504f3));
  const Float f = Float{_mm256_castsi256_ps((bits - left<23>(exponent)).v)} - floats(1.0f);
  const Float s = f / (floats(2.0f) + f), s2 = s * s;
  const Float series =
      s2 * (floats(0.333333333f) +
            s2 * (floats(0.2f) +
                  s2 * (floats(0.142857143f) + s2 * (floats(0.111111111f) + s2 * floats(0.0909090909f)))));
  return toFloat(exponent) + (f - s * (f - floats(2.0f) * series)) * floats(1.44269504f);
}

/// kernel::power of x in [0, 1].
SCOLOPAX_AVX2 Float power(Float x, Float exponent) {
  const Float one = floats(1.0f);
  const Mask some = x > floats(kernel::kLeastNormal), whole = x >= one;
  const Float inner = select(without(some, whole), x, floats(0.5f));
  const Float result = minimum(exp2Of(exponent * log2Of(inner)), one);
  return where(some, select(whole, one, result));
}

/// kernel::absorbed.
SCOLOPAX_AVX2 Float absorbed(Float depth) {
  const Float one = floats(1.0f);
  const Float series =
      depth *
      (one - depth * (floats(0.5f) -
                      depth * (floats(0.166666667f) -
                               depth * (floats(0.0416666667f) -
                                        depth * (floats(0.00833333333f) - depth * floats(0.00138888889f))))));
  const Mask thin = depth < floats(0.25f);
  if (bitsOf(thin) == 0xff) return series;
  return select(thin, series, one - exp2Of(depth * floats(-1.44269504f)));
}

}  // namespace scolopax::lanes
#endif
