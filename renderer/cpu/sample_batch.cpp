// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/sample_batch.h"

#include "renderer/kernel/sample_volume.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace scolopax {
namespace {

using kernel::ChannelView;
using kernel::PointBatch;

void sampleBaseline(const ChannelView& channel, glm::ivec3 dims, const PointBatch& points, float* values) {
  for (int i = 0; i < kernel::kBatchPoints; ++i)
    values[i] = kernel::sampleStored(channel, dims, glm::vec3(points.x[i], points.y[i], points.z[i]));
}

#if defined(__x86_64__)
// Functions, not files, have the instruction set: an inline function of a header that a file of its own
// compiled for AVX2 might be the one that the linker keeps for everybody.
#define SCOLOPAX_AVX2 __attribute__((target("avx2"), always_inline)) inline

/// kernel::axisWeight of eight points: neighbours' indices, and the weight of the second.
struct Axis {
  __m256i low, high;
  __m256 t;
  __m256i swapped;  ///< lanes at the last voxel, where the neighbour is the one before
};
SCOLOPAX_AVX2 Axis axisOf(const float* x, int size) {
  const __m256 inside =
      _mm256_min_ps(_mm256_max_ps(_mm256_loadu_ps(x), _mm256_setzero_ps()), _mm256_set1_ps(float(size - 1)));
  const __m256i whole = _mm256_cvttps_epi32(inside), last = _mm256_set1_epi32(size - 2);
  const __m256i swapped = _mm256_cmpgt_epi32(whole, last);
  const __m256 t = _mm256_sub_ps(inside, _mm256_cvtepi32_ps(whole));
  return {whole, _mm256_blendv_epi8(_mm256_add_epi32(whole, _mm256_set1_epi32(1)), last, swapped),
          _mm256_andnot_ps(_mm256_castsi256_ps(swapped), t), swapped};
}

SCOLOPAX_AVX2 __m256 lerp8(__m256 a, __m256 b, __m256 t) {
  return _mm256_add_ps(a, _mm256_mul_ps(t, _mm256_sub_ps(b, a)));
}

/// Interpolates along x between the voxels at `index` and `index` + 1; one read gets both where they are
/// small.
template <class T>
SCOLOPAX_AVX2 __m256 alongX(const T* voxels, __m256i index, const Axis& x) {
  __m256 a, b;
  const auto* base = reinterpret_cast<const int*>(voxels);
  if constexpr (sizeof(T) == 4) {
    a = _mm256_i32gather_ps(reinterpret_cast<const float*>(voxels), index, 4);
    b = _mm256_i32gather_ps(reinterpret_cast<const float*>(voxels) + 1, index, 4);
  } else {
    const __m256i pair = _mm256_i32gather_epi32(base, index, int(sizeof(T)));
    __m256i first, second;
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      first = _mm256_and_si256(pair, _mm256_set1_epi32(0xff));
      second = _mm256_and_si256(_mm256_srli_epi32(pair, 8), _mm256_set1_epi32(0xff));
    } else if constexpr (std::is_same_v<T, std::uint16_t>) {
      first = _mm256_and_si256(pair, _mm256_set1_epi32(0xffff));
      second = _mm256_srli_epi32(pair, 16);
    } else {
      first = _mm256_srai_epi32(_mm256_slli_epi32(pair, 16), 16);
      second = _mm256_srai_epi32(pair, 16);
    }
    a = _mm256_cvtepi32_ps(first);
    b = _mm256_cvtepi32_ps(second);
  }
  const __m256 swapped = _mm256_castsi256_ps(x.swapped);
  return lerp8(_mm256_blendv_ps(a, b, swapped), _mm256_blendv_ps(b, a, swapped), x.t);
}

template <class T>
__attribute__((target("avx2"))) void trilinear8(const T* voxels, glm::ivec3 dims, const Axis& x,
                                                const Axis& y, const Axis& z, int firstZ, float* values) {
  const __m256i row = _mm256_set1_epi32(dims.x), slice = _mm256_set1_epi32(dims.x * dims.y);
  const T* base = voxels + std::size_t(firstZ) * std::size_t(dims.x) * std::size_t(dims.y);
  const __m256i startZ = _mm256_set1_epi32(firstZ);
  const __m256i column = _mm256_min_epi32(x.low, _mm256_set1_epi32(dims.x - 2));
  const __m256i yLow = _mm256_add_epi32(_mm256_mullo_epi32(y.low, row), column);
  const __m256i yHigh = _mm256_add_epi32(_mm256_mullo_epi32(y.high, row), column);
  const __m256i zLow = _mm256_mullo_epi32(_mm256_sub_epi32(z.low, startZ), slice);
  const __m256i zHigh = _mm256_mullo_epi32(_mm256_sub_epi32(z.high, startZ), slice);
  const __m256 c00 = alongX(base, _mm256_add_epi32(yLow, zLow), x);
  const __m256 c10 = alongX(base, _mm256_add_epi32(yHigh, zLow), x);
  const __m256 c01 = alongX(base, _mm256_add_epi32(yLow, zHigh), x);
  const __m256 c11 = alongX(base, _mm256_add_epi32(yHigh, zHigh), x);
  _mm256_storeu_ps(values, lerp8(lerp8(c00, c10, y.t), lerp8(c01, c11, y.t), z.t));
}

__attribute__((target("avx2"))) void sampleAvx2(const ChannelView& channel, glm::ivec3 dims,
                                                const PointBatch& points, float* values) {
  // Indices are of 32 bits and count from the slice of the first point.
  const float reach = points.z[kernel::kBatchPoints - 1] - points.z[0];
  const float slices = (reach < 0 ? -reach : reach) + 3.0f;
  if (dims.x < 2 || dims.y < 2 || dims.z < 2 || !(slices * float(dims.x) * float(dims.y) < 0x1p29f))
    return sampleBaseline(channel, dims, points, values);
  const Axis x = axisOf(points.x, dims.x), y = axisOf(points.y, dims.y), z = axisOf(points.z, dims.z);
  const int firstZ = _mm256_cvtsi256_si32(z.low);
  visitScalarType(channel.type, [&](auto zero) {
    trilinear8(static_cast<const decltype(zero)*>(channel.voxels), dims, x, y, z, firstZ, values);
  });
}
#endif

}  // namespace

bool available(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::avx2) return __builtin_cpu_supports("avx2");
#endif
  return set == InstructionSet::baseline;
}

InstructionSet fastestInstructionSet() {
  return available(InstructionSet::avx2) ? InstructionSet::avx2 : InstructionSet::baseline;
}

kernel::SampleBatch sampleBatchFor(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::avx2) return sampleAvx2;
#endif
  return set == InstructionSet::baseline ? sampleBaseline : nullptr;
}

}  // namespace scolopax
