// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/sample_batch.h"

#include <cstring>

#include "renderer/cpu/lanes.h"
#include "renderer/kernel/sample_volume.h"

namespace scolopax {
namespace {

using kernel::ChannelView;
using kernel::kBatchPoints;
using kernel::PointBatch;
using kernel::SceneView;

void sampleBaseline(const SceneView& scene, std::uint32_t channels, const PointBatch& points,
                    float (*values)[kBatchPoints]) {
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(channels >> n & 1)) continue;
    for (int i = 0; i < kBatchPoints; ++i)
      values[n][i] =
          kernel::sampleStored(scene.channels[n], scene.dims, {points.x[i], points.y[i], points.z[i]});
  }
}

#if defined(__x86_64__)
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
SCOLOPAX_AVX2 __m128 lerp4(__m128 a, __m128 b, float t) {
  return _mm_add_ps(a, _mm_mul_ps(_mm_set1_ps(t), _mm_sub_ps(b, a)));
}

SCOLOPAX_AVX2 int largestOf(__m256i x) {
  const __m128i four = _mm_max_epi32(_mm256_castsi256_si128(x), _mm256_extracti128_si256(x, 1));
  const __m128i two = _mm_max_epi32(four, _mm_shuffle_epi32(four, 0x4e));
  return _mm_cvtsi128_si32(_mm_max_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}

/// Voxels at eight indices.
template <class T>
SCOLOPAX_AVX2 __m256 gather(const T* voxels, __m256i index) {
  if constexpr (std::is_same_v<T, float>) return _mm256_i32gather_ps(voxels, index, 4);
  const __m256i word = _mm256_i32gather_epi32(reinterpret_cast<const int*>(voxels), index, int(sizeof(T)));
  if constexpr (std::is_same_v<T, std::uint8_t>)
    return _mm256_cvtepi32_ps(_mm256_and_si256(word, _mm256_set1_epi32(0xff)));
  if constexpr (std::is_same_v<T, std::uint16_t>)
    return _mm256_cvtepi32_ps(_mm256_and_si256(word, _mm256_set1_epi32(0xffff)));
  return _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(word, 16), 16));
}

/// Interpolates along x from the voxels at `index` to the neighbours, `stride` further; of small ones that
/// are next to each other one read gets both.
template <class T>
SCOLOPAX_AVX2 __m256 alongX(const T* voxels, __m256i index, int stride, const Axis& x) {
  __m256 a, b;
  if (sizeof(T) == 4 || stride != 1) {
    a = gather(voxels, index);
    b = gather(voxels + stride, index);
  } else {
    const __m256i pair = _mm256_i32gather_epi32(reinterpret_cast<const int*>(voxels), index, int(sizeof(T)));
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

/// Four channels of a voxel.
SCOLOPAX_AVX2 __m128 load4(const std::uint8_t* v) {
  int bytes;
  std::memcpy(&bytes, v, sizeof bytes);
  return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(bytes)));
}
SCOLOPAX_AVX2 __m128 load4(const std::uint16_t* v) {
  return _mm_cvtepi32_ps(_mm_cvtepu16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(v))));
}
SCOLOPAX_AVX2 __m128 load4(const std::int16_t* v) {
  return _mm_cvtepi32_ps(_mm_cvtepi16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(v))));
}
SCOLOPAX_AVX2 __m128 load4(const float* v) { return _mm_loadu_ps(v); }

/// The eight points among the voxels of one type.
struct Places {
  Axis x, y, z;
  std::size_t first;  ///< index of the slice that indices count from
  glm::ivec3 dims;
};

/// One channel at eight points.
template <class T>
SCOLOPAX_AVX2_ONLY void sampleOne(const Places& at, const ChannelView& channel, float* values) {
  const int stride = channel.stride;
  const T* base = static_cast<const T*>(channel.voxels) + channel.lane +
                  at.first * std::size_t(at.dims.x) * std::size_t(at.dims.y) * std::size_t(stride);
  const __m256i step = _mm256_set1_epi32(stride), row = _mm256_set1_epi32(at.dims.x * stride);
  const __m256i slice = _mm256_set1_epi32(at.dims.x * at.dims.y * stride);
  const __m256i start = _mm256_set1_epi32(int(at.first));
  const __m256i column =
      _mm256_mullo_epi32(_mm256_min_epi32(at.x.low, _mm256_set1_epi32(at.dims.x - 2)), step);
  const __m256i yLow = _mm256_add_epi32(_mm256_mullo_epi32(at.y.low, row), column);
  const __m256i yHigh = _mm256_add_epi32(_mm256_mullo_epi32(at.y.high, row), column);
  const __m256i zLow = _mm256_mullo_epi32(_mm256_sub_epi32(at.z.low, start), slice);
  const __m256i zHigh = _mm256_mullo_epi32(_mm256_sub_epi32(at.z.high, start), slice);
  const __m256 c00 = alongX(base, _mm256_add_epi32(yLow, zLow), stride, at.x);
  const __m256 c10 = alongX(base, _mm256_add_epi32(yHigh, zLow), stride, at.x);
  const __m256 c01 = alongX(base, _mm256_add_epi32(yLow, zHigh), stride, at.x);
  const __m256 c11 = alongX(base, _mm256_add_epi32(yHigh, zHigh), stride, at.x);
  _mm256_storeu_ps(values, lerp8(lerp8(c00, c10, at.y.t), lerp8(c01, c11, at.y.t), at.z.t));
}

/// Four neighbouring channels at eight points; members[lane - first lane] is where a channel's values go, or
/// null.
template <class T>
SCOLOPAX_AVX2_ONLY void sampleFour(const Places& at, const ChannelView& channel, int lane,
                                   float* const* members) {
  const auto stride = std::size_t(channel.stride), row = stride * std::size_t(at.dims.x),
             slice = row * std::size_t(at.dims.y);
  const T* base = static_cast<const T*>(channel.voxels) + lane;
  alignas(32) std::int32_t low[3][kBatchPoints], high[3][kBatchPoints];
  alignas(32) float t[3][kBatchPoints];
  const Axis* axes[] = {&at.x, &at.y, &at.z};
  for (int a = 0; a < 3; ++a) {
    _mm256_store_si256(reinterpret_cast<__m256i*>(low[a]), axes[a]->low);
    _mm256_store_si256(reinterpret_cast<__m256i*>(high[a]), axes[a]->high);
    _mm256_store_ps(t[a], axes[a]->t);
  }
  for (int i = 0; i < kBatchPoints; ++i) {
    const std::size_t xLow = std::size_t(low[0][i]) * stride, xHigh = std::size_t(high[0][i]) * stride;
    const std::size_t yLow = std::size_t(low[1][i]) * row, yHigh = std::size_t(high[1][i]) * row;
    const T* zLow = base + std::size_t(low[2][i]) * slice;
    const T* zHigh = base + std::size_t(high[2][i]) * slice;
    const __m128 c00 = lerp4(load4(zLow + yLow + xLow), load4(zLow + yLow + xHigh), t[0][i]);
    const __m128 c10 = lerp4(load4(zLow + yHigh + xLow), load4(zLow + yHigh + xHigh), t[0][i]);
    const __m128 c01 = lerp4(load4(zHigh + yLow + xLow), load4(zHigh + yLow + xHigh), t[0][i]);
    const __m128 c11 = lerp4(load4(zHigh + yHigh + xLow), load4(zHigh + yHigh + xHigh), t[0][i]);
    alignas(16) float four[4];
    _mm_store_ps(four, lerp4(lerp4(c00, c10, t[1][i]), lerp4(c01, c11, t[1][i]), t[2][i]));
    for (int k = 0; k < 4; ++k)
      if (members[k]) members[k][i] = four[k];
  }
}

SCOLOPAX_AVX2_ONLY void sampleAvx2(const SceneView& scene, std::uint32_t channels, const PointBatch& points,
                                   float (*values)[kBatchPoints]) {
  const glm::ivec3 dims = scene.dims;
  if (dims.x < 2 || dims.y < 2 || dims.z < 2) return sampleBaseline(scene, channels, points, values);
  Places at{axisOf(points.x, dims.x), axisOf(points.y, dims.y), axisOf(points.z, dims.z), 0, dims};
  // A gather's indices are of 32 bits and count from the slice of the first point.
  const __m256i slices =
      _mm256_sub_epi32(at.z.low, _mm256_permutevar8x32_epi32(at.z.low, _mm256_setzero_si256()));
  at.first = std::size_t(_mm256_cvtsi256_si32(at.z.low));
  const float near = float(largestOf(_mm256_abs_epi32(slices)) + 3) * float(dims.x) * float(dims.y);
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(channels >> n & 1)) continue;
    const ChannelView& channel = scene.channels[n];
    // Channels that lie in the same four.
    const int lane = channel.lane & ~3;
    float* members[4] = {};
    std::uint32_t found = 0;
    for (int m = n; m < scene.channelCount; ++m)
      if ((channels >> m & 1) && scene.channels[m].voxels == channel.voxels &&
          (scene.channels[m].lane & ~3) == lane) {
        members[scene.channels[m].lane - lane] = values[m];
        found |= 1u << m;
      }
    const bool several = (found & (found - 1)) != 0;
    if (!several && !(near * float(channel.stride) < 0x1p29f)) {
      sampleBaseline(scene, found, points, values);
    } else {
      visitScalarType(channel.type, [&](auto zero) {
        using T = decltype(zero);
        if (several)
          sampleFour<T>(at, channel, lane, members);
        else
          sampleOne<T>(at, channel, values[n]);
      });
    }
    channels &= ~found;
  }
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
