// SPDX-License-Identifier: Apache-2.0
// The AVX2 lane type, with eight lanes (kernel/lanes.h explains the functions). Included before all kernels,
// and only in files for this instruction set.
#pragma once
#include <immintrin.h>

#include <cstdint>

#define SCOLOPAX_SIMD_SPACE lanes_avx2
#define SCOLOPAX_SIMD __attribute__((target("avx2")))
#define SCOLOPAX_SIMD_INLINE __attribute__((target("avx2"), always_inline))
#include "renderer/kernel/portable.h"

namespace scolopax::lanes_avx2 {

inline constexpr int kLanes = 8;

struct Mask {
  __m256 v;
};
SCOLOPAX_LANES Mask operator&(Mask a, Mask b) { return {_mm256_and_ps(a.v, b.v)}; }
SCOLOPAX_LANES Mask operator|(Mask a, Mask b) { return {_mm256_or_ps(a.v, b.v)}; }
SCOLOPAX_LANES Mask without(Mask a, Mask b) { return {_mm256_andnot_ps(b.v, a.v)}; }
SCOLOPAX_LANES Mask everywhere() { return {_mm256_castsi256_ps(_mm256_set1_epi32(-1))}; }
SCOLOPAX_LANES Mask maskOf(unsigned bits) {
  const __m256i each = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i set = _mm256_and_si256(_mm256_set1_epi32(int(bits)), each);
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, each))};
}
SCOLOPAX_LANES unsigned bitsOf(Mask a) { return unsigned(_mm256_movemask_ps(a.v)); }
SCOLOPAX_LANES bool any(Mask a) {
  return !_mm256_testz_si256(_mm256_castps_si256(a.v), _mm256_castps_si256(a.v));
}

struct Int {
  __m256i v;
  Int() = default;
  SCOLOPAX_LANES Int(__m256i x) : v(x) {}
  SCOLOPAX_LANES Int(std::int32_t x) : v(_mm256_set1_epi32(x)) {}
  SCOLOPAX_LANES Int(std::uint32_t x) : v(_mm256_set1_epi32(std::int32_t(x))) {}
};
SCOLOPAX_LANES Int operator+(Int a, Int b) { return {_mm256_add_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Int operator-(Int a, Int b) { return {_mm256_sub_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Int operator*(Int a, Int b) { return {_mm256_mullo_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Int operator&(Int a, Int b) { return {_mm256_and_si256(a.v, b.v)}; }
SCOLOPAX_LANES Int operator^(Int a, Int b) { return {_mm256_xor_si256(a.v, b.v)}; }
SCOLOPAX_LANES Int operator|(Int a, Int b) { return {_mm256_or_si256(a.v, b.v)}; }
template <int kBits>
SCOLOPAX_LANES Int left(Int a) {
  return {_mm256_slli_epi32(a.v, kBits)};
}
template <int kBits>
SCOLOPAX_LANES Int right(Int a) {
  return {_mm256_srli_epi32(a.v, kBits)};
}
template <int kBits>
SCOLOPAX_LANES Int rightSigned(Int a) {
  return {_mm256_srai_epi32(a.v, kBits)};
}
SCOLOPAX_LANES Int minimum(Int a, Int b) { return {_mm256_min_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Int maximum(Int a, Int b) { return {_mm256_max_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Mask operator==(Int a, Int b) { return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(a.v, b.v))}; }
SCOLOPAX_LANES Mask operator>(Int a, Int b) { return {_mm256_castsi256_ps(_mm256_cmpgt_epi32(a.v, b.v))}; }
SCOLOPAX_LANES Int select(Mask m, Int a, Int b) {
  return {_mm256_blendv_epi8(b.v, a.v, _mm256_castps_si256(m.v))};
}
SCOLOPAX_LANES Int where(Mask m, Int a) { return {_mm256_and_si256(_mm256_castps_si256(m.v), a.v)}; }
SCOLOPAX_LANES Int onesOf(Mask m) { return {_mm256_srli_epi32(_mm256_castps_si256(m.v), 31)}; }
SCOLOPAX_LANES Int load(const std::int32_t* from) {
  return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from))};
}
SCOLOPAX_LANES void store(Int a, std::int32_t* to) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), a.v);
}
SCOLOPAX_LANES Int permuted(Int a, Int index) { return {_mm256_permutevar8x32_epi32(a.v, index.v)}; }
SCOLOPAX_LANES Int laneNumbers() { return {_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)}; }
SCOLOPAX_LANES int firstOf(Int a) { return _mm256_cvtsi256_si32(a.v); }
SCOLOPAX_LANES int largestOf(Int a) {
  const __m128i four = _mm_max_epi32(_mm256_castsi256_si128(a.v), _mm256_extracti128_si256(a.v, 1));
  const __m128i two = _mm_max_epi32(four, _mm_shuffle_epi32(four, 0x4e));
  return _mm_cvtsi128_si32(_mm_max_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}
SCOLOPAX_LANES unsigned unionOf(Int a) {
  const __m128i four = _mm_or_si128(_mm256_castsi256_si128(a.v), _mm256_extracti128_si256(a.v, 1));
  const __m128i two = _mm_or_si128(four, _mm_shuffle_epi32(four, 0x4e));
  return unsigned(_mm_cvtsi128_si32(_mm_or_si128(two, _mm_shuffle_epi32(two, 0xb1))));
}

struct Float {
  __m256 v;
  Float() = default;
  SCOLOPAX_LANES Float(__m256 x) : v(x) {}
  SCOLOPAX_LANES Float(float x) : v(_mm256_set1_ps(x)) {}
};
SCOLOPAX_LANES Float load(const float* from) { return {_mm256_loadu_ps(from)}; }
SCOLOPAX_LANES void store(Float a, float* to) { _mm256_storeu_ps(to, a.v); }
SCOLOPAX_LANES Float permuted(Float a, Int index) { return {_mm256_permutevar8x32_ps(a.v, index.v)}; }
SCOLOPAX_LANES float firstOf(Float a) { return _mm256_cvtss_f32(a.v); }
SCOLOPAX_LANES Float operator+(Float a, Float b) { return {_mm256_add_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float operator-(Float a, Float b) { return {_mm256_sub_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float operator*(Float a, Float b) { return {_mm256_mul_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float operator/(Float a, Float b) { return {_mm256_div_ps(a.v, b.v)}; }
SCOLOPAX_LANES Mask operator<(Float a, Float b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)}; }
SCOLOPAX_LANES Mask operator<=(Float a, Float b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)}; }
SCOLOPAX_LANES Mask operator==(Float a, Float b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_EQ_OQ)}; }
SCOLOPAX_LANES Float select(Mask m, Float a, Float b) { return {_mm256_blendv_ps(b.v, a.v, m.v)}; }
SCOLOPAX_LANES Float where(Mask m, Float a) { return {_mm256_and_ps(m.v, a.v)}; }
SCOLOPAX_LANES Float minimum(Float a, Float b) { return {_mm256_min_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float maximum(Float a, Float b) { return {_mm256_max_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float squareRoot(Float x) { return {_mm256_sqrt_ps(x.v)}; }
SCOLOPAX_LANES Int truncated(Float x) { return {_mm256_cvttps_epi32(x.v)}; }
SCOLOPAX_LANES Float toFloat(Int x) { return {_mm256_cvtepi32_ps(x.v)}; }
SCOLOPAX_LANES Int bitsOf(Float x) { return {_mm256_castps_si256(x.v)}; }
SCOLOPAX_LANES Float floatOf(Int bits) { return {_mm256_castsi256_ps(bits.v)}; }
SCOLOPAX_LANES float smallestOf(Float x) {
  const __m128 four = _mm_min_ps(_mm256_castps256_ps128(x.v), _mm256_extractf128_ps(x.v, 1));
  const __m128 two = _mm_min_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps(two, two, 1)));
}

SCOLOPAX_LANES Float gather(const float* base, Int index) { return {_mm256_i32gather_ps(base, index.v, 4)}; }
template <int kScale>
SCOLOPAX_LANES Int gatherWords(const void* base, Int index) {
  return {_mm256_i32gather_epi32(static_cast<const int*>(base), index.v, kScale)};
}

}  // namespace scolopax::lanes_avx2

#include "renderer/cpu/lanes.h"
