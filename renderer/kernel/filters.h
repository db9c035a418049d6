// SPDX-License-Identifier: Apache-2.0
// Samples of a field by its filter: trilinear, by the cubic B-spline, or the nearest voxel.
#pragma once
#include "renderer/kernel/sample_volume.h"

namespace scolopax::kernel {

/// Bound of the rounding error of a sample between finite voxels, relative to the largest of their
/// magnitudes: of three nested interpolations (9 x 2^-24), or of six. Samples between equal voxels are exact.
SCOLOPAX_HD constexpr float roundingOf(Filter filter) {
  return filter == Filter::cubic ? 0x1p-19f : 0x1p-20f;
}

/// Index along an axis of the voxel nearest to x; of two, the later.
SCOLOPAX_HD inline int nearestVoxel(float x, int size) {
  const AxisPoint point(x, size);
  return point.past() >= 0.5f ? point.voxel + 1 : point.voxel;  // x + 0.5 would be rounded
}

/// One axis of a sample by the uniform cubic B-spline, which weighs four voxels: two linear interpolations,
/// and one between their results (Sigg and Hadwiger, "Fast Third-Order Texture Filtering", GPU Gems 2, 2005).
/// In this form rounding keeps a constant field constant, and the spline between the values of its voxels.
struct SplineAxis {
  std::size_t offset[4];      ///< of the voxels, in the array; those beyond the border are the outermost ones
  float low, high, mix;       ///< weight of the second of either pair, and of the second pair
  float lowSlope, highSlope;  ///< the same for the derivative, which is `slope` times the difference of the
  float slope;                ///< second pair from the first
};
/// At `t` in [0,1] between voxel `low` and the next one.
SCOLOPAX_HD inline SplineAxis splineAxis(int low, float t, int size, std::size_t stride) {
  SplineAxis axis;
  for (int i = 0; i < 4; ++i) axis.offset[i] = std::size_t(clampInt(low - 1 + i, 0, size - 1)) * stride;
  const float s = 1.0f - t;
  // Six times the weights of the four voxels.
  const float w0 = s * s * s, w1 = 4.0f + t * t * (3.0f * t - 6.0f), w2 = 4.0f + s * s * (3.0f * s - 6.0f),
              w3 = t * t * t;
  axis.low = w1 / (w0 + w1);
  axis.high = w3 / (w2 + w3);
  axis.mix = (w2 + w3) * 0.166666667f;
  axis.slope = 0.5f + t * s;
  axis.lowSlope = t * (2.0f - 1.5f * t) / axis.slope;
  axis.highSlope = 0.5f * t * t / axis.slope;
  return axis;
}

/// The spline along an axis over the values of(0) to of(3), and its derivative.
template <class Of>
SCOLOPAX_HD float splineOver(const SplineAxis& axis, Of&& of) {
  return lerp(lerp(of(0), of(1), axis.low), lerp(of(2), of(3), axis.high), axis.mix);
}
template <class Of>
SCOLOPAX_HD float slopeOver(const SplineAxis& axis, Of&& of) {
  return axis.slope * (lerp(of(2), of(3), axis.highSlope) - lerp(of(0), of(1), axis.lowSlope));
}

/// The three axes of a sample by the spline.
struct SplineAxes {
  SplineAxis x, y, z;
  /// At a place in the cell that begins at voxel `low`, from (0,0,0) to (1,1,1).
  SCOLOPAX_HD SplineAxes(const FieldView& field, glm::ivec3 dims, glm::ivec3 low, glm::vec3 place)
      : SplineAxes(VoxelStrides(field, dims), dims, low, place) {}

  /// Calls f(j, k, of) for the 16 rows of voxels; of(i) is voxel i of the row.
  template <class F>
  SCOLOPAX_HD void visitRows(const FieldView& field, F&& f) const {
    visitScalarType(field.type, [&](auto zero) {
      const auto* voxels = static_cast<const decltype(zero)*>(field.voxels) + field.lane;
      for (int k = 0; k < 4; ++k)
        for (int j = 0; j < 4; ++j) {
          const auto* row = voxels + z.offset[k] + y.offset[j];
          f(j, k, [&](int i) { return float(row[x.offset[i]]); });
        }
    });
  }

 private:
  SCOLOPAX_PART SplineAxes(const VoxelStrides& strides, glm::ivec3 dims, glm::ivec3 low, glm::vec3 place)
      : x(splineAxis(low.x, place.x, dims.x, strides.x)),
        y(splineAxis(low.y, place.y, dims.y, strides.y)),
        z(splineAxis(low.z, place.z, dims.z, strides.z)) {}
};

/// At a point in voxel coordinates.
SCOLOPAX_HD inline SplineAxes splineAxesAt(const FieldView& field, glm::ivec3 dims, glm::vec3 point) {
  glm::ivec3 low;
  for (int axis = 0; axis < 3; ++axis) {
    const AxisPoint on(point[axis], dims[axis]);
    point[axis] = on.at;
    low[axis] = clampInt(on.voxel, 0, lastCell(dims[axis]));
  }
  return {field, dims, low, point - glm::vec3(low)};
}

/// Value of the spline.
SCOLOPAX_HD inline float splineValue(const FieldView& field, const SplineAxes& axes) {
  float rows[4][4];
  axes.visitRows(field, [&](int j, int k, auto&& of) { rows[k][j] = splineOver(axes.x, of); });
  return splineOver(axes.z, [&](int k) { return splineOver(axes.y, [&](int j) { return rows[k][j]; }); });
}

/// Sets `*stored` to a sample of a field whose filter is not trilinear.
SCOLOPAX_RARE inline void sampleFiltered(const FieldView& field, glm::ivec3 dims, const glm::vec3& point,
                                         float* stored) {
  if (field.filter == Filter::nearest) {
    const std::size_t x = std::size_t(nearestVoxel(point.x, dims.x)),
                      y = std::size_t(nearestVoxel(point.y, dims.y)),
                      z = std::size_t(nearestVoxel(point.z, dims.z));
    const std::size_t at =
        ((z * std::size_t(dims.y) + y) * std::size_t(dims.x) + x) * std::size_t(field.stride);
    *stored = visitScalarType(field.type, [&](auto zero) {
      return float(static_cast<const decltype(zero)*>(field.voxels)[std::size_t(field.lane) + at]);
    });
    return;
  }
  *stored = splineValue(field, splineAxesAt(field, dims, point));
}

/// Gradient of the cubic B-spline, per voxel along each axis. Not finite if any of the 64 voxels is not
/// finite.
SCOLOPAX_RARE inline void findSplineGradient(const FieldView& field, glm::ivec3 dims, const glm::vec3& point,
                                             glm::vec3* perVoxel) {
  const SplineAxes axes = splineAxesAt(field, dims, point);
  float rows[4][4], slopes[4][4];
  axes.visitRows(field, [&](int j, int k, auto&& of) {
    rows[k][j] = splineOver(axes.x, of);
    slopes[k][j] = slopeOver(axes.x, of);
  });
  // Over the rows of a slice, and over the slices.
  const auto alongYAndZ = [&](auto&& overY, auto&& overZ, const float(&of)[4][4]) {
    return overZ([&](int k) { return overY([&](int j) { return of[k][j]; }); });
  };
  const auto smoothY = [&](auto&& of) { return splineOver(axes.y, of); };
  const auto smoothZ = [&](auto&& of) { return splineOver(axes.z, of); };
  *perVoxel = {alongYAndZ(smoothY, smoothZ, slopes),
               alongYAndZ([&](auto&& of) { return slopeOver(axes.y, of); }, smoothZ, rows),
               alongYAndZ(
                   smoothY, [&](auto&& of) { return slopeOver(axes.z, of); }, rows)};
}

/// Stored value of a field at a point in voxel coordinates, by its filter. Not finite if one of the voxels
/// that the filter reads is not: eight, the 64 of the B-spline, or one.
template <class L>
SCOLOPAX_LANES typename L::Float sampleStored(const FieldView& field, glm::ivec3 dims,
                                              const typename L::Vec& point) {
  if (!field.has(Filter::trilinear)) [[unlikely]] {
    typename L::Float stored;
    sampleFiltered(field, dims, point, &stored);
    return stored;
  }
  return sampleTrilinear(field, dims, point);
}

}  // namespace scolopax::kernel
