// SPDX-License-Identifier: Apache-2.0
// The AVX-512 lane type, with sixteen lanes (kernel/lanes.h explains the functions). Included before all
// kernels, and only in files for this instruction set.
#pragma once
#include <immintrin.h>

#include <cstdint>

#define SCOLOPAX_SIMD_SPACE lanes_avx512
#define SCOLOPAX_SIMD __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl")))
#define SCOLOPAX_SIMD_INLINE __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl"), always_inline))
#include "renderer/kernel/portable.h"

namespace scolopax::lanes_avx512 {

inline constexpr int kLanes = 16;

struct Mask {
  __mmask16 v;
};
SCOLOPAX_LANES Mask operator&(Mask a, Mask b) { return {_kand_mask16(a.v, b.v)}; }
SCOLOPAX_LANES Mask operator|(Mask a, Mask b) { return {_kor_mask16(a.v, b.v)}; }
SCOLOPAX_LANES Mask without(Mask a, Mask b) { return {_kandn_mask16(b.v, a.v)}; }
SCOLOPAX_LANES Mask everywhere() { return {0xffff}; }
SCOLOPAX_LANES Mask maskOf(unsigned bits) { return {_cvtu32_mask16(bits)}; }
SCOLOPAX_LANES unsigned bitsOf(Mask a) { return _cvtmask16_u32(a.v); }
SCOLOPAX_LANES bool any(Mask a) { return _cvtmask16_u32(a.v) != 0; }

struct Int {
  __m512i v;
  Int() = default;
  SCOLOPAX_LANES Int(__m512i x) : v(x) {}
  SCOLOPAX_LANES Int(std::int32_t x) : v(_mm512_set1_epi32(x)) {}
  SCOLOPAX_LANES Int(std::uint32_t x) : v(_mm512_set1_epi32(std::int32_t(x))) {}
};
SCOLOPAX_LANES Int operator+(Int a, Int b) { return {_mm512_add_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Int operator-(Int a, Int b) { return {_mm512_sub_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Int operator*(Int a, Int b) { return {_mm512_mullo_epi32(a.v, b.v)}; }
SCOLOPAX_LANES Int operator&(Int a, Int b) { return {_mm512_and_si512(a.v, b.v)}; }
SCOLOPAX_LANES Int operator^(Int a, Int b) { return {_mm512_xor_si512(a.v, b.v)}; }
SCOLOPAX_LANES Int operator|(Int a, Int b) { return {_mm512_or_si512(a.v, b.v)}; }
// Some intrinsics are the masked ones, because GCC 12 warns that the others use an uninitialised vector.
template <int kBits>
SCOLOPAX_LANES Int left(Int a) {
  return {_mm512_maskz_slli_epi32(0xffff, a.v, kBits)};
}
template <int kBits>
SCOLOPAX_LANES Int right(Int a) {
  return {_mm512_maskz_srli_epi32(0xffff, a.v, kBits)};
}
template <int kBits>
SCOLOPAX_LANES Int rightSigned(Int a) {
  return {_mm512_maskz_srai_epi32(0xffff, a.v, kBits)};
}
SCOLOPAX_LANES Int minimum(Int a, Int b) { return {_mm512_maskz_min_epi32(0xffff, a.v, b.v)}; }
SCOLOPAX_LANES Int maximum(Int a, Int b) { return {_mm512_maskz_max_epi32(0xffff, a.v, b.v)}; }
SCOLOPAX_LANES Mask operator==(Int a, Int b) { return {_mm512_cmpeq_epi32_mask(a.v, b.v)}; }
SCOLOPAX_LANES Mask operator>(Int a, Int b) { return {_mm512_cmpgt_epi32_mask(a.v, b.v)}; }
SCOLOPAX_LANES Int select(Mask m, Int a, Int b) { return {_mm512_mask_blend_epi32(m.v, b.v, a.v)}; }
SCOLOPAX_LANES Int where(Mask m, Int a) { return {_mm512_maskz_mov_epi32(m.v, a.v)}; }
SCOLOPAX_LANES Int onesOf(Mask m) { return {_mm512_maskz_set1_epi32(m.v, 1)}; }
SCOLOPAX_LANES Int load(const std::int32_t* from) { return {_mm512_loadu_si512(from)}; }
SCOLOPAX_LANES void store(Int a, std::int32_t* to) { _mm512_storeu_si512(to, a.v); }
SCOLOPAX_LANES Int permuted(Int a, Int index) {
  return {_mm512_maskz_permutexvar_epi32(0xffff, index.v, a.v)};
}
SCOLOPAX_LANES Int laneNumbers() {
  return {_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)};
}
SCOLOPAX_LANES int firstOf(Int a) { return _mm512_cvtsi512_si32(a.v); }
template <int kHalf>
SCOLOPAX_LANES __m256i half(Int a) {
  return _mm512_maskz_extracti32x8_epi32(0xff, a.v, kHalf);
}
SCOLOPAX_LANES int largestOf(Int a) {
  const __m256i eight = _mm256_max_epi32(half<0>(a), half<1>(a));
  const __m128i four = _mm_max_epi32(_mm256_castsi256_si128(eight), _mm256_extracti128_si256(eight, 1));
  const __m128i two = _mm_max_epi32(four, _mm_shuffle_epi32(four, 0x4e));
  return _mm_cvtsi128_si32(_mm_max_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}
SCOLOPAX_LANES unsigned unionOf(Int a) {
  const __m256i eight = _mm256_or_si256(half<0>(a), half<1>(a));
  const __m128i four = _mm_or_si128(_mm256_castsi256_si128(eight), _mm256_extracti128_si256(eight, 1));
  const __m128i two = _mm_or_si128(four, _mm_shuffle_epi32(four, 0x4e));
  return unsigned(_mm_cvtsi128_si32(_mm_or_si128(two, _mm_shuffle_epi32(two, 0xb1))));
}

struct Float {
  __m512 v;
  Float() = default;
  SCOLOPAX_LANES Float(__m512 x) : v(x) {}
  SCOLOPAX_LANES Float(float x) : v(_mm512_set1_ps(x)) {}
};
SCOLOPAX_LANES Float load(const float* from) { return {_mm512_loadu_ps(from)}; }
SCOLOPAX_LANES void store(Float a, float* to) { _mm512_storeu_ps(to, a.v); }
SCOLOPAX_LANES Float permuted(Float a, Int index) {
  return {_mm512_maskz_permutexvar_ps(0xffff, index.v, a.v)};
}
SCOLOPAX_LANES float firstOf(Float a) { return _mm512_cvtss_f32(a.v); }
SCOLOPAX_LANES Float operator+(Float a, Float b) { return {_mm512_add_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float operator-(Float a, Float b) { return {_mm512_sub_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float operator*(Float a, Float b) { return {_mm512_mul_ps(a.v, b.v)}; }
SCOLOPAX_LANES Float operator/(Float a, Float b) { return {_mm512_div_ps(a.v, b.v)}; }
SCOLOPAX_LANES Mask operator<(Float a, Float b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)}; }
SCOLOPAX_LANES Mask operator<=(Float a, Float b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)}; }
SCOLOPAX_LANES Mask operator==(Float a, Float b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_EQ_OQ)}; }
SCOLOPAX_LANES Float select(Mask m, Float a, Float b) { return {_mm512_mask_blend_ps(m.v, b.v, a.v)}; }
SCOLOPAX_LANES Float where(Mask m, Float a) { return {_mm512_maskz_mov_ps(m.v, a.v)}; }
SCOLOPAX_LANES Float minimum(Float a, Float b) { return {_mm512_maskz_min_ps(0xffff, a.v, b.v)}; }
SCOLOPAX_LANES Float maximum(Float a, Float b) { return {_mm512_maskz_max_ps(0xffff, a.v, b.v)}; }
SCOLOPAX_LANES Float squareRoot(Float x) { return {_mm512_maskz_sqrt_ps(0xffff, x.v)}; }
SCOLOPAX_LANES Int truncated(Float x) { return {_mm512_maskz_cvttps_epi32(0xffff, x.v)}; }
SCOLOPAX_LANES Float toFloat(Int x) { return {_mm512_maskz_cvtepi32_ps(0xffff, x.v)}; }
SCOLOPAX_LANES Int bitsOf(Float x) { return {_mm512_castps_si512(x.v)}; }
SCOLOPAX_LANES Float floatOf(Int bits) { return {_mm512_castsi512_ps(bits.v)}; }
SCOLOPAX_LANES float smallestOf(Float x) {
  const __m256 eight =
      _mm256_min_ps(_mm512_maskz_extractf32x8_ps(0xff, x.v, 0), _mm512_maskz_extractf32x8_ps(0xff, x.v, 1));
  const __m128 four = _mm_min_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
  const __m128 two = _mm_min_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps(two, two, 1)));
}

SCOLOPAX_LANES Float gather(const float* base, Int index) {
  return {_mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xffff, index.v, base, 4)};
}
template <int kScale>
SCOLOPAX_LANES Int gatherWords(const void* base, Int index) {
  return {_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), 0xffff, index.v, base, kScale)};
}

}  // namespace scolopax::lanes_avx512

#include "renderer/cpu/lanes.h"
