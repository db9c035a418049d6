// SPDX-License-Identifier: Apache-2.0
// Trilinear interpolation of stored voxels between voxel centres; beyond the outermost centres, the edge
// value.
#pragma once
#include <cstddef>

#include "renderer/kernel/math.h"
#include "renderer/kernel/views.h"

namespace scolopax::kernel {

/// Distance in the array from a field's voxel to the next one along each axis.
struct VoxelStrides {
  std::size_t x, y, z;
  SCOLOPAX_PART VoxelStrides(const FieldView& field, glm::ivec3 dims)
      : x(std::size_t(field.stride)), y(x * std::size_t(dims.x)), z(y * std::size_t(dims.y)) {}
};

/// Number of the last cell along an axis, which lies between the last two voxels; 0 for a single voxel.
SCOLOPAX_HD constexpr int lastCell(int size) { return size > 1 ? size - 2 : 0; }

/// A coordinate along an axis, moved to the nearest point between the outermost voxel centres, and the voxel
/// at or before it. CellPlaces and cpu/sample_lanes.h do the same for many lanes. Other code that looks alike
/// differs on purpose: on a face, VoxelCell takes the cell that the ray enters; and VoxelWalk and SurfaceWalk
/// look for planes between cells, from points that may be outside the volume.
struct AxisPoint {
  float at;
  int voxel;
  SCOLOPAX_PART AxisPoint(float x, int size) : at(clamp(x, 0.0f, float(size - 1))), voxel(int(at)) {}
  /// Distance from the voxel, in [0,1).
  SCOLOPAX_PART float past() const { return at - float(voxel); }
};

/// One axis of a fetch: the array offsets of the two neighbours, and the weight of the second. At the last
/// voxel and beyond, axisWeight() swaps the neighbours and returns the weight 0, so that the last voxel's
/// value comes out exactly, whatever finite value is beside it.
struct AxisWeight {
  std::size_t low, high;
  float t;
};

SCOLOPAX_HD inline AxisWeight axisWeight(float x, int size, std::size_t stride) {
  const AxisPoint point(x, size);
  const int last = lastCell(size), whole = point.voxel;
  if (whole > last) return {std::size_t(whole) * stride, std::size_t(last) * stride, 0.0f};
  return {std::size_t(whole) * stride, std::size_t(size > 1 ? whole + 1 : 0) * stride, point.past()};
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

/// Stored value of a field at a point in voxel coordinates. Not finite if and only if one of the eight
/// corners is not (differences cannot overflow: Volume keeps float voxels below 2^124).
SCOLOPAX_HD inline float sampleTrilinear(const FieldView& field, glm::ivec3 dims, glm::vec3 point) {
  const VoxelStrides strides(field, dims);
  const AxisWeight x = axisWeight(point.x, dims.x, strides.x);
  const AxisWeight y = axisWeight(point.y, dims.y, strides.y);
  const AxisWeight z = axisWeight(point.z, dims.z, strides.z);
  return visitScalarType(field.type, [&](auto zero) {
    return trilinear(static_cast<const decltype(zero)*>(field.voxels) + field.lane, x, y, z);
  });
}

/// The eight voxels of a cell, x fastest.
inline constexpr int kCorners = 8;

/// Voxels of the cell that contains a point in voxel coordinates. Beyond the outermost centres, those of the
/// nearest cell; along an axis with a single voxel, both are that one.
SCOLOPAX_HD inline void cellVoxels(const FieldView& field, glm::ivec3 dims, glm::vec3 point, float* corners) {
  std::size_t low = 0, step[3];
  auto stride = std::size_t(field.stride);
  for (int axis = 0; axis < 3; ++axis) {
    const int size = dims[axis];
    low += std::size_t(int(clamp(point[axis], 0.0f, float(lastCell(size))))) * stride;
    step[axis] = size > 1 ? stride : 0;
    stride *= std::size_t(size);
  }
  visitScalarType(field.type, [&](auto zero) {
    const auto* voxels = static_cast<const decltype(zero)*>(field.voxels) + field.lane + low;
    for (int c = 0; c < kCorners; ++c)
      corners[c] = float(voxels[(c & 1 ? step[0] : 0) + (c & 2 ? step[1] : 0) + (c & 4 ? step[2] : 0)]);
  });
}

/// Place of points in the cell of eight voxels that contains `point`: 0 at its lower voxel, 1 at its upper.
template <class L>
struct CellPlaces {
  typename L::Vec low;
  glm::ivec3 dims;

  SCOLOPAX_LANES CellPlaces(glm::ivec3 size, const typename L::Vec& point) : low(0.0f), dims(size) {
    for (int axis = 0; axis < 3; ++axis)
      low[axis] = toFloat(truncated(clamp(point[axis], 0.0f, float(lastCell(size[axis])))));
  }
  SCOLOPAX_LANES typename L::Vec of(const typename L::Vec& point) const {
    typename L::Vec place(0.0f);
    for (int axis = 0; axis < 3; ++axis)
      place[axis] = clamp(point[axis], 0.0f, float(dims[axis] - 1)) - low[axis];
    return place;
  }
};

/// Interpolates between a cell's voxels at a place in it.
template <class L>
SCOLOPAX_LANES typename L::Float interpolate(const typename L::Float* corners, const typename L::Vec& place) {
  using Float = typename L::Float;
  const Float c00 = lerp(corners[0], corners[1], place[0]), c10 = lerp(corners[2], corners[3], place[0]);
  const Float c01 = lerp(corners[4], corners[5], place[0]), c11 = lerp(corners[6], corners[7], place[0]);
  return lerp(lerp(c00, c10, place[1]), lerp(c01, c11, place[1]), place[2]);
}

}  // namespace scolopax::kernel
