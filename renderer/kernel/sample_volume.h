// SPDX-License-Identifier: Apache-2.0
// Trilinear interpolation of stored voxels between voxel centres; beyond the outermost centres, the edge
// value.
#pragma once
#include <cstddef>

#include "renderer/kernel/math.h"
#include "renderer/kernel/views.h"

namespace scolopax::kernel {

/// One axis of a fetch: the array offsets of the two neighbours, and the weight of the second. At the last
/// voxel and beyond, axisWeight() swaps the neighbours and returns the weight 0, so that the last voxel's
/// value comes out exactly, whatever finite value is beside it.
struct AxisWeight {
  std::size_t low, high;
  float t;
};

SCOLOPAX_HD inline AxisWeight axisWeight(float x, int size, std::size_t stride) {
  const float inside = clamp(x, 0.0f, float(size - 1));
  const int last = size > 1 ? size - 2 : 0;
  const int whole = int(inside);
  if (whole > last) return {std::size_t(whole) * stride, std::size_t(last) * stride, 0.0f};
  return {std::size_t(whole) * stride, std::size_t(size > 1 ? whole + 1 : 0) * stride, inside - float(whole)};
}

/// Exact where a == b. Between a and b except for rounding, which the macrocells allow for.
SCOLOPAX_HD inline float lerp(float a, float b, float t) { return a + t * (b - a); }

template <class T>
SCOLOPAX_HD float trilinear(const T* v, const AxisWeight& x, const AxisWeight& y, const AxisWeight& z) {
  const T* v00 = v + y.low + z.low;
  const T* v10 = v + y.high + z.low;
  const T* v01 = v + y.low + z.high;
  const T* v11 = v + y.high + z.high;
  const float c00 = lerp(float(v00[x.low]), float(v00[x.high]), x.t);
  const float c10 = lerp(float(v10[x.low]), float(v10[x.high]), x.t);
  const float c01 = lerp(float(v01[x.low]), float(v01[x.high]), x.t);
  const float c11 = lerp(float(v11[x.low]), float(v11[x.high]), x.t);
  return lerp(lerp(c00, c10, y.t), lerp(c01, c11, y.t), z.t);
}

/// Stored value of one channel at a point in voxel coordinates. Not finite if and only if one of the eight
/// corners is not (differences cannot overflow: Volume keeps float voxels below 2^124).
SCOLOPAX_HD inline float sampleStored(const ChannelView& channel, glm::ivec3 dims, glm::vec3 point) {
  const auto stride = std::size_t(channel.stride);
  const AxisWeight x = axisWeight(point.x, dims.x, stride);
  const AxisWeight y = axisWeight(point.y, dims.y, stride * std::size_t(dims.x));
  const AxisWeight z = axisWeight(point.z, dims.z, stride * std::size_t(dims.x) * std::size_t(dims.y));
  return visitScalarType(channel.type, [&](auto zero) {
    return trilinear(static_cast<const decltype(zero)*>(channel.voxels) + channel.lane, x, y, z);
  });
}

}  // namespace scolopax::kernel
