// SPDX-License-Identifier: Apache-2.0
// kernel/sample_volume.h and kernel/filters.h for one point per lane, with the same bits. Single channels are
// gathered; neighbouring channels are read four at a time. Included after lanes_*.h.
#pragma once
#include <bit>
#include <cstring>

#include "renderer/kernel/filters.h"

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// As kernel::AxisWeight, for one axis: the voxel indices of the two neighbours, and the weight of the
/// second.
struct Axis {
  Int low, high;
  Float t;
  Mask swapped;  ///< at the last voxel, where the neighbour is the one before
};
/// `size` must be at least 2.
SCOLOPAX_LANES Axis axisOf(Float x, int size) {
  const Float inside = clamp(x, 0.0f, float(size - 1));
  const Int whole = truncated(inside), last = Int(size - 2);
  const Mask swapped = whole > last;
  const Float t = inside - toFloat(whole);
  return {whole, select(swapped, last, whole + Int(1)), select(swapped, Float(0.0f), t), swapped};
}

/// One point per lane, and its neighbouring voxels.
struct Points {
  glm::ivec3 dims;
  Vec point;
  Axis x, y, z;
  std::size_t first;  ///< slice from which gathers count their 32-bit indices: that of lane 0
  float slices;       ///< upper limit of the number of slices that these indices span
};
SCOLOPAX_LANES Points pointsAt(glm::ivec3 dims, const Vec& point) {
  Points points;
  points.dims = dims;
  points.point = point;
  points.x = axisOf(point[0], dims.x), points.y = axisOf(point[1], dims.y),
  points.z = axisOf(point[2], dims.z);
  points.first = std::size_t(firstOf(points.z.low));
  const Int away = points.z.low - Int(int(points.first));
  points.slices = float(largestOf(maximum(away, Int(0) - away)) + 3);
  return points;
}
/// Lane i of points that are in memory.
SCOLOPAX_LANES glm::vec3 pointIn(const Vec& point, int i) {
  const auto lane = [&](int axis)
                        SCOLOPAX_LANES_LAMBDA { return reinterpret_cast<const float*>(&point[axis])[i]; };
  return {lane(0), lane(1), lane(2)};
}
/// Whether an axis has a single voxel. Lanes need a neighbour on every axis.
SCOLOPAX_LANES bool isFlat(glm::ivec3 dims) { return dims.x < 2 || dims.y < 2 || dims.z < 2; }

SCOLOPAX_LANES Float lerp(Float a, Float b, Float t) { return a + t * (b - a); }
SCOLOPAX_LANES __m128 lerp4(__m128 a, __m128 b, float t) {
  return _mm_add_ps(a, _mm_mul_ps(_mm_set1_ps(t), _mm_sub_ps(b, a)));
}

/// Voxels at the given indices.
template <class T>
SCOLOPAX_LANES Float voxelsAt(const T* voxels, Int index) {
  if constexpr (std::is_same_v<T, float>) return gather(voxels, index);
  const Int word = gatherWords<int(sizeof(T))>(voxels, index);
  if constexpr (std::is_same_v<T, std::uint8_t>) return toFloat(word & 0xff);
  if constexpr (std::is_same_v<T, std::uint16_t>) return toFloat(word & 0xffff);
  return toFloat(rightSigned<16>(left<16>(word)));
}

/// Reads the voxels at `index` and their neighbours, `stride` further on. Adjacent voxels of less than 32
/// bits are read in pairs.
template <class T>
SCOLOPAX_LANES void readPair(const T* voxels, Int index, int stride, Float* a, Float* b) {
  if (sizeof(T) == 4 || stride != 1) {
    *a = voxelsAt(voxels, index);
    *b = voxelsAt(voxels + stride, index);
    return;
  }
  const Int pair = gatherWords<int(sizeof(T))>(voxels, index);
  if constexpr (std::is_same_v<T, std::uint8_t>)
    *a = toFloat(pair & 0xff), *b = toFloat(right<8>(pair) & 0xff);
  else if constexpr (std::is_same_v<T, std::uint16_t>)
    *a = toFloat(pair & 0xffff), *b = toFloat(right<16>(pair));
  else
    *a = toFloat(rightSigned<16>(left<16>(pair))), *b = toFloat(rightSigned<16>(pair));
}

/// Interpolates along x between the voxels at `index` and their neighbours.
template <class T>
SCOLOPAX_LANES Float alongX(const T* voxels, Int index, int stride, const Axis& x) {
  Float a, b;
  readPair(voxels, index, stride, &a, &b);
  return lerp(select(x.swapped, b, a), select(x.swapped, a, b), x.t);
}

/// Samples one channel, whose voxels are of type T, by gathering.
template <class T>
SCOLOPAX_LANES Float sampleOne(const Points& at, const kernel::FieldView& field) {
  const int stride = field.stride;
  const T* base = static_cast<const T*>(field.voxels) + field.lane +
                  at.first * std::size_t(at.dims.x) * std::size_t(at.dims.y) * std::size_t(stride);
  const Int row = Int(at.dims.x * stride), slice = Int(at.dims.x * at.dims.y * stride);
  const Int start = Int(int(at.first));
  const Int column = minimum(at.x.low, Int(at.dims.x - 2)) * Int(stride);
  const Int yLow = at.y.low * row + column, yHigh = at.y.high * row + column;
  const Int zLow = (at.z.low - start) * slice, zHigh = (at.z.high - start) * slice;
  const Float c00 = alongX(base, yLow + zLow, stride, at.x);
  const Float c10 = alongX(base, yHigh + zLow, stride, at.x);
  const Float c01 = alongX(base, yLow + zHigh, stride, at.x);
  const Float c11 = alongX(base, yHigh + zHigh, stride, at.x);
  return lerp(lerp(c00, c10, at.y.t), lerp(c01, c11, at.y.t), at.z.t);
}

/// Whether every axis has neighbours, and 32-bit indices suffice for gathers.
SCOLOPAX_LANES bool canGather(const Points& at, const kernel::FieldView& field) {
  return !isFlat(at.dims) && at.slices * float(at.dims.x) * float(at.dims.y) * float(field.stride) < 0x1p29f;
}

/// Samples one channel of any type: by gathering if that is possible, else lane by lane. The switch stands
/// for visitScalarType(), which is not compiled for the instruction set and so could not inline sampleOne().
SCOLOPAX_LANES Float sampleChannel(const Points& at, const kernel::FieldView& field) {
  if (!canGather(at, field)) {
    Float values;
    for (int i = 0; i < kLanes; ++i)
      put(kernel::sampleTrilinear(field, at.dims, pointIn(at.point, i)), i, &values);
    return values;
  }
  switch (field.type) {
    case ScalarType::u8:
      return sampleOne<std::uint8_t>(at, field);
    case ScalarType::u16:
      return sampleOne<std::uint16_t>(at, field);
    case ScalarType::i16:
      return sampleOne<std::int16_t>(at, field);
    case ScalarType::f32:
      break;
  }
  return sampleOne<float>(at, field);
}

/// Reads four channels of a voxel.
SCOLOPAX_LANES __m128 load4(const std::uint8_t* v) {
  int bytes;
  std::memcpy(&bytes, v, sizeof bytes);
  return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(bytes)));
}
SCOLOPAX_LANES __m128 load4(const std::uint16_t* v) {
  return _mm_cvtepi32_ps(_mm_cvtepu16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(v))));
}
SCOLOPAX_LANES __m128 load4(const std::int16_t* v) {
  return _mm_cvtepi32_ps(_mm_cvtepi16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(v))));
}
SCOLOPAX_LANES __m128 load4(const float* v) { return _mm_loadu_ps(v); }

/// Channels that are read together: up to four neighbours, the first of which is at `lane`.
struct FourChannels {
  int lane;
  int channel[4];       ///< visible channel at lane + i; -1: none
  std::uint32_t found;  ///< their bits
  bool several() const { return (found & (found - 1)) != 0; }
};
/// Those of `channels` (bit n: visible channel n) that are read together with channel n, of the same filter.
SCOLOPAX_SIMD inline FourChannels fourWith(const kernel::SceneView& scene, int n, std::uint32_t channels) {
  const kernel::FieldView& field = scene.channels[n].field;
  FourChannels four{field.lane & ~3, {-1, -1, -1, -1}, 0};
  for (int m = n; m < scene.channelCount; ++m) {
    const kernel::FieldView& other = scene.channels[m].field;
    if (!(channels >> m & 1) || other.voxels != field.voxels || (other.lane & ~3) != four.lane ||
        other.filter != field.filter)
      continue;
    four.channel[other.lane - four.lane] = m;
    four.found |= 1u << m;
  }
  return four;
}

/// Samples four neighbouring channels, the first of which is at `lane`. The values of the channel at lane + i
/// go to members[i], unless that is null.
template <class T>
SCOLOPAX_SIMD void sampleFour(const Points& at, const kernel::FieldView& field, int lane,
                              float* const* members) {
  const kernel::VoxelStrides strides(field, at.dims);
  const T* base = static_cast<const T*>(field.voxels) + lane;
  alignas(4 * kLanes) std::int32_t low[3][kLanes], high[3][kLanes];
  alignas(4 * kLanes) float t[3][kLanes];
  const Axis* axes[] = {&at.x, &at.y, &at.z};
  for (int a = 0; a < 3; ++a) {
    store(axes[a]->low, low[a]);
    store(axes[a]->high, high[a]);
    store(axes[a]->t, t[a]);
  }
  for (int i = 0; i < kLanes; ++i) {
    const std::size_t xLow = std::size_t(low[0][i]) * strides.x, xHigh = std::size_t(high[0][i]) * strides.x;
    const std::size_t yLow = std::size_t(low[1][i]) * strides.y, yHigh = std::size_t(high[1][i]) * strides.y;
    const T* zLow = base + std::size_t(low[2][i]) * strides.z;
    const T* zHigh = base + std::size_t(high[2][i]) * strides.z;
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

SCOLOPAX_LANES Float sampleTrilinear(const kernel::FieldView& field, glm::ivec3 dims, const Vec& point) {
  return sampleChannel(pointsAt(dims, point), field);
}

/// As kernel::sampleFiltered and kernel::findSplineGradient, lane by lane.
SCOLOPAX_LANES_APART inline void sampleFiltered(const kernel::FieldView& field, glm::ivec3 dims,
                                                const Vec& point, Float* stored) {
  for (int i = 0; i < kLanes; ++i) {
    float one;
    kernel::sampleFiltered(field, dims, pointIn(point, i), &one);
    put(one, i, stored);
  }
}
SCOLOPAX_LANES_APART inline void findSplineGradient(const kernel::FieldView& field, glm::ivec3 dims,
                                                    const Vec& point, Vec* perVoxel) {
  for (int i = 0; i < kLanes; ++i) {
    glm::vec3 one;
    kernel::findSplineGradient(field, dims, pointIn(point, i), &one);
    for (int axis = 0; axis < 3; ++axis) put(one[axis], i, &(*perVoxel)[axis]);
  }
}

/// Samples `channels` (bit n: visible channel n). The values of channel n go to values[n].
SCOLOPAX_LANES void sampleChannels(const kernel::SceneView& scene, std::uint32_t channels, const Vec& point,
                                   Float* values) {
  const Points at = pointsAt(scene.dims, point);
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(channels >> n & 1)) continue;
    const kernel::FieldView& field = scene.channels[n].field;
    if (!field.has(kernel::Filter::trilinear)) [[unlikely]] {
      sampleFiltered(field, scene.dims, point, &values[n]);
      continue;
    }
    const FourChannels four = fourWith(scene, n, channels);
    channels &= ~four.found;
    if (!four.several() || isFlat(scene.dims)) {
      for (std::uint32_t left = four.found; left != 0; left &= left - 1) {
        const int m = std::countr_zero(left);
        values[m] = sampleChannel(at, scene.channels[m].field);
      }
      continue;
    }
    float* members[4] = {};
    for (int k = 0; k < 4; ++k)
      if (four.channel[k] >= 0) members[k] = reinterpret_cast<float*>(&values[four.channel[k]]);
    visitScalarType(field.type,
                    [&](auto zero) { sampleFour<decltype(zero)>(at, field, four.lane, members); });
  }
}

/// Reads a cell's voxels of one channel, which are of type T, by gathering.
template <class T>
SCOLOPAX_LANES void cellVoxelsOfOne(const Points& at, const kernel::FieldView& field, Float* corners) {
  const int stride = field.stride;
  const T* base = static_cast<const T*>(field.voxels) + field.lane +
                  at.first * std::size_t(at.dims.x) * std::size_t(at.dims.y) * std::size_t(stride);
  const Int row = Int(at.dims.x * stride), slice = Int(at.dims.x * at.dims.y * stride);
  // The last voxel on an axis is the upper one of its cell.
  const Int z = minimum(at.z.low, Int(at.dims.z - 2)) - Int(int(at.first));
  const Int low = z * slice + minimum(at.y.low, Int(at.dims.y - 2)) * row +
                  minimum(at.x.low, Int(at.dims.x - 2)) * Int(stride);
  readPair(base, low, stride, &corners[0], &corners[1]);
  readPair(base, low + row, stride, &corners[2], &corners[3]);
  readPair(base, low + slice, stride, &corners[4], &corners[5]);
  readPair(base, low + row + slice, stride, &corners[6], &corners[7]);
}

/// The same for four neighbouring channels, the first of which is at `lane`. The voxels of the channel at
/// lane + i go to members[i], unless that is null.
template <class T>
SCOLOPAX_SIMD void cellVoxelsOfFour(const Points& at, const kernel::FieldView& field, int lane,
                                    float* const* members) {
  const kernel::VoxelStrides strides(field, at.dims);
  const T* base = static_cast<const T*>(field.voxels) + lane;
  alignas(4 * kLanes) std::int32_t low[3][kLanes];
  store(minimum(at.x.low, Int(at.dims.x - 2)), low[0]);
  store(minimum(at.y.low, Int(at.dims.y - 2)), low[1]);
  store(minimum(at.z.low, Int(at.dims.z - 2)), low[2]);
  for (int i = 0; i < kLanes; ++i) {
    const T* first = base + std::size_t(low[2][i]) * strides.z + std::size_t(low[1][i]) * strides.y +
                     std::size_t(low[0][i]) * strides.x;
    for (int c = 0; c < kernel::kCorners; ++c) {
      alignas(16) float four[4];
      _mm_store_ps(
          four, load4(first + (c & 1 ? strides.x : 0) + (c & 2 ? strides.y : 0) + (c & 4 ? strides.z : 0)));
      for (int k = 0; k < 4; ++k)
        if (members[k]) members[k][c * kLanes + i] = four[k];
    }
  }
}

/// The same for one channel of any type.
SCOLOPAX_LANES void cellVoxelsOfChannel(const kernel::SceneView& scene, const Points& at, int n,
                                        Float* corners) {
  const kernel::FieldView& field = scene.channels[n].field;
  if (canGather(at, field)) {
    switch (field.type) {
      case ScalarType::u8:
        return cellVoxelsOfOne<std::uint8_t>(at, field, corners);
      case ScalarType::u16:
        return cellVoxelsOfOne<std::uint16_t>(at, field, corners);
      case ScalarType::i16:
        return cellVoxelsOfOne<std::int16_t>(at, field, corners);
      case ScalarType::f32:
        return cellVoxelsOfOne<float>(at, field, corners);
    }
  }
  for (int i = 0; i < kLanes; ++i) {
    float own[kernel::kCorners];
    kernel::cellVoxels(field, scene.dims, pointIn(at.point, i), own);
    for (int c = 0; c < kernel::kCorners; ++c) put(own[c], i, &corners[c]);
  }
}

/// Voxels of the cells that contain points, as kernel::cellVoxels, of all of `channels` (bit n: visible
/// channel n). Those of channel n go to corners[n].
SCOLOPAX_LANES void cellVoxels(const kernel::SceneView& scene, std::uint32_t channels, const Vec& point,
                               Float (*corners)[kernel::kCorners]) {
  const Points at = pointsAt(scene.dims, point);
  for (int n = 0; n < scene.channelCount; ++n) {
    if (!(channels >> n & 1)) continue;
    const FourChannels four = fourWith(scene, n, channels);
    channels &= ~four.found;
    if (!four.several() || isFlat(scene.dims)) {
      for (std::uint32_t left = four.found; left != 0; left &= left - 1)
        cellVoxelsOfChannel(scene, at, std::countr_zero(left), corners[std::countr_zero(left)]);
      continue;
    }
    float* members[4] = {};
    for (int k = 0; k < 4; ++k)
      if (four.channel[k] >= 0) members[k] = reinterpret_cast<float*>(corners[four.channel[k]]);
    visitScalarType(scene.channels[n].field.type, [&](auto zero) {
      cellVoxelsOfFour<decltype(zero)>(at, scene.channels[n].field, four.lane, members);
    });
  }
}

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
