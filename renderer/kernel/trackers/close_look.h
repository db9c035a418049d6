// SPDX-License-Identifier: Apache-2.0
// Close tracking of thick macrocells: bounds the extinction over short stretches of a ray, from the voxels
// around it. With the macrocell's bound alone, a ray would cross the empty space beside dense matter in many
// short steps, each ending in a null collision.
#pragma once
#include "renderer/kernel/collision.h"

namespace scolopax::kernel {

/// After kPatience null collisions in a macrocell, a tracker switches to close tracking for the rest of it if
/// the bound predicts more than kManyCollisions further ones.
inline constexpr std::uint32_t kPatience = 32;
inline constexpr float kManyCollisions = 128.0f;
/// Expected tentative collisions per stretch and channel that are few enough for the stretch's bound.
inline constexpr float kFewCollisions = 2.0f;

/// `stuck`: the cell needs close tracking.
enum class CellOutcome { nothing, hit, exhausted, stuck };

/// A voxel cell, which lies between eight voxels: the one that a ray passes through after a point. `way` is
/// how far the ray goes in it, in world units. Outer cells extend to the faces of the box. With
/// nearest-voxel interpolation, it is the part of the cell that is nearest to one of the eight.
struct VoxelCell {
  glm::ivec3 low;
  float way;
  glm::vec3 begin, end;  ///< first and last points, in voxel coordinates
  glm::ivec3 nearest;    ///< the nearest voxel, with such interpolation

  SCOLOPAX_HD VoxelCell(const SceneView& scene, const Ray& ray, glm::vec3 point)
      : low(0), way(kInfinity), nearest(0) {
    const glm::ivec3 dims = scene.dims;
    for (int axis = 0; axis < 3; ++axis) {
      const int last = lastCell(dims[axis]);
      const float direction = ray.direction[axis];
      const AxisPoint on(point[axis], dims[axis]);
      const bool entersLower = direction < 0.0f && float(on.voxel) == on.at;
      low[axis] = clampInt(entersLower ? on.voxel - 1 : on.voxel, 0, last);
      begin[axis] = low[axis] == 0 ? -0.5f : float(low[axis]);
      end[axis] = low[axis] + 2 >= dims[axis] ? float(dims[axis]) - 0.5f : float(low[axis] + 1);
      if (scene.hasNearest() && dims[axis] > 1) [[unlikely]]
        if (takeHalf(axis, direction, on.at, point[axis])) continue;
      if (direction == 0.0f || low[axis] == (direction > 0.0f ? last : 0)) continue;
      const int plane = direction > 0.0f ? low[axis] + 1 : low[axis];
      way = minimum(way, (float(plane) - point[axis]) / direction);
    }
  }
  /// The point, moved into the cell if rounding has put it outside, because the cell's bounds hold only
  /// there.
  SCOLOPAX_HD glm::vec3 inside(glm::vec3 point) const {
    for (int axis = 0; axis < 3; ++axis) point[axis] = clamp(point[axis], begin[axis], end[axis]);
    return point;
  }
  /// Place of a point in the cell: 0 at the lower voxel, 1 at the upper one, if there is one. Unlike that of
  /// CellPlaces, it is never outside the cell, whatever the rounding: samples stay between the cell's voxels.
  SCOLOPAX_HD glm::vec3 placeOf(glm::ivec3 dims, glm::vec3 point) const {
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = clamp(point[axis] - float(low[axis]), 0.0f, dims[axis] > 1 ? 1.0f : 0.0f);
    return point;
  }

 private:
  /// Takes the half of the cell in which the ray is, along an axis. Returns whether it leaves that half
  /// between the two voxels.
  SCOLOPAX_HD bool takeHalf(int axis, float direction, float inside, float at) {
    const float middle = float(low[axis]) + 0.5f;
    const bool upper = direction < 0.0f ? inside > middle : inside >= middle;
    nearest[axis] = low[axis] + int(upper);
    if (upper)
      begin[axis] = middle;
    else
      end[axis] = floatOf(bitsOf(middle) - 1);  // in the middle, the upper voxel is the nearest
    if (direction == 0.0f || upper == (direction > 0.0f)) return false;
    way = minimum(way, (middle - at) / direction);
    return true;
  }
};

/// Stored values of a field in a voxel cell: at a point, and the smallest and largest of the voxels that
/// samples in the cell depend on. The value is not finite if one of these is not.
struct CellValues {
  float value, lo, hi;
};
/// valuesIn() for filters other than trilinear.
SCOLOPAX_RARE inline void findFilteredValues(const FieldView& field, glm::ivec3 dims, const VoxelCell& cell,
                                             const glm::vec3& point, CellValues* values) {
  if (field.filter == Filter::nearest) {
    sampleFiltered(field, dims, glm::vec3(cell.nearest), &values->value);
    values->lo = values->hi = values->value;
    return;
  }
  const SplineAxes axes(field, dims, cell.low, cell.placeOf(dims, point));
  values->value = splineValue(field, axes);
  values->lo = kInfinity, values->hi = -kInfinity;
  axes.visitRows(field, [&](int, int, auto&& of) {
    for (int i = 0; i < 4; ++i) {
      values->lo = minimum(values->lo, of(i));
      values->hi = maximum(values->hi, of(i));
    }
  });
}
SCOLOPAX_HD inline CellValues valuesIn(const FieldView& field, glm::ivec3 dims, const VoxelCell& cell,
                                       glm::vec3 point) {
  if (!field.has(Filter::trilinear)) [[unlikely]] {
    CellValues values;
    findFilteredValues(field, dims, cell, point, &values);
    return values;
  }
  const glm::vec3 place = cell.placeOf(dims, point);
  const auto axisOf = [&](int axis, std::size_t stride) {
    const int low = cell.low[axis], high = low + 1 < dims[axis] ? low + 1 : low;
    return AxisWeight{std::size_t(low) * stride, std::size_t(high) * stride, place[axis]};
  };
  const VoxelStrides strides(field, dims);
  const AxisWeight x = axisOf(0, strides.x), y = axisOf(1, strides.y), z = axisOf(2, strides.z);
  return visitScalarType(field.type, [&](auto zero) {
    const auto* v = static_cast<const decltype(zero)*>(field.voxels) + field.lane;
    CellValues values{trilinear(v, x, y, z), kInfinity, -kInfinity};
    for (const std::size_t k : {z.low, z.high})
      for (const std::size_t j : {y.low, y.high})
        for (const std::size_t i : {x.low, x.high}) {
          values.lo = minimum(values.lo, float(v[i + j + k]));
          values.hi = maximum(values.hi, float(v[i + j + k]));
        }
    return values;
  });
}

/// Bound of channel n's extinction over the next `*way` (world units) from `point`. Halves `*way` while the
/// bound is loose and `*way` is above `least`. The slope of the scalar along the ray is bounded by the range
/// of the voxels.
template <class View>
SCOLOPAX_HD float boundAhead(const View& scene, int n, const Ray& ray, const VoxelCell& cell, glm::vec3 point,
                             float least, float* way, SampleCost* cost) {
  const ChannelView& channel = scene.channels[n];
  cost->fetches += channel.field.cost();
  const CellValues values = valuesIn(channel.field, scene.dims, cell, point);
  if (!isFinite(values.value)) return 0.0f;  // then no sample of this cell is finite
  const float slope = (values.hi - values.lo) * sumOfMagnitudes(ray.direction);
  // By how much rounding may put a sample outside the voxels' range; an end at 0 is exact.
  const float slack = values.lo < values.hi ? maximum(magnitude(values.lo), magnitude(values.hi)) *
                                                  roundingOf(channel.field.filter)
                                            : 0.0f;
  const float lo = values.lo == 0.0f ? 0.0f : values.lo - slack;
  const float hi = values.hi == 0.0f ? 0.0f : values.hi + slack;
  return withClassifier(scene, n, [&](auto classifier) {
    cost->fetches += classifier.fetches(channel.field, scene.dims);
    const typename decltype(classifier)::Nearby nearby(channel, scene.dims, cell.low, point, ray.direction);
    if (!nearby.finite()) return 0.0f;
    const float here = nearby.at(values.value);
    for (;; *way *= 0.5f) {
      const float reach = slope * *way + slack;
      const float bound =
          nearby.bound(maximum(lo, values.value - reach), minimum(hi, values.value + reach), *way);
      if (bound * *way <= kFewCollisions || bound <= 2.0f * here || !(*way > least)) return bound;
    }
  });
}

/// Tracks through the walk's macrocell, from distance `past` after its entry to distance `end`, in stretches
/// with bounds of their own. On entry and exit, `random` and `depth` belong to the next tentative collision.
/// `boundOf(cell, point, least, &way)` bounds a stretch as boundAhead does; `test(bound, distance,
/// point, random)` tests a tentative collision.
template <class Bound, class Test, class View>
SCOLOPAX_HD CellOutcome trackCellClosely(const View& scene, const Ray& ray, const CellWalk& walk, float past,
                                         float end, Sampler& sampler, RandomBlock* random, float* depth,
                                         std::uint32_t* tentative, std::optional<Collision>* hit,
                                         Bound&& boundOf, Test&& test) {
  float way = end - past;
  while (past < end) {
    const float t = walk.enter() + past;
    const glm::vec3 point = walk.pointAt(t);
    const VoxelCell cell(scene, ray, point);
    // Shorter stretches might make no progress because of rounding.
    const float least = maximum(t * 0x1p-21f, end * 0x1p-20f);
    way = minimum(maximum(minimum(4.0f * way, cell.way), least), end - past);
    const float bound = boundOf(cell, cell.inside(point), least, &way);
    const float total = bound * way;
    float passed = 0.0f;
    while (*depth < total - passed) {
      passed += *depth;
      const RayDistance distance{walk.enter(), past + passed / bound};
      if (const auto found = test(bound, distance, cell.inside(walk.pointAt(distance.t())), *random)) {
        *hit = found;
        return CellOutcome::hit;
      }
      if (++*tentative >= kMaxTentativeCollisions) return CellOutcome::exhausted;
      *random = sampler.next();
      *depth = opticalDepth(uniformOf(random->x));
    }
    *depth -= total - passed;
    past += way;
    if (++*tentative >= kMaxTentativeCollisions || scene.isCancelled()) return CellOutcome::exhausted;
  }
  return CellOutcome::nothing;
}

/// Number of tentative collisions at which a tracker checks whether to switch to close tracking.
SCOLOPAX_HD inline std::uint32_t patienceAfter(std::uint32_t tentative) {
  return tentative + kPatience < kMaxTentativeCollisions ? tentative + kPatience : kMaxTentativeCollisions;
}

/// Which channels along<kClosely> considers. Only along<true> tests them: it also tracks all rays on which
/// some channels are clipped.
template <bool kClosely>
SCOLOPAX_HD auto channelsFor([[maybe_unused]] const Interval& inside) {
  if constexpr (kClosely)
    return SomeChannels{inside.channels};
  else
    return AllChannels{};
}

struct CloselyTracked {
  std::optional<Collision> hit;
  std::uint32_t blocks;  ///< random blocks drawn before and during tracking
  SampleCost cost;
};
template <class Track, class View>
SCOLOPAX_APART CloselyTracked trackClosely(Track track, const View& scene, Ray ray, Interval inside,
                                           Sampler sampler) {
  SampleCost cost;
  bool stuck = false;
  const auto hit = track.template along<true>(scene, ray, inside, sampler, &cost, &stuck);
  return {hit, sampler.blocks(), cost};
}

/// Tracks a ray by Track::along<kClosely>. along<false> assumes that no channels are clipped; where it would
/// switch to close tracking, it sets `stuck` and stops. along<true> then tracks the ray again from its start,
/// with the same random numbers, so that it reaches the same point. This keeps close tracking out of the loop
/// that most rays run, which would be up to a fifth slower with it. On a device, both loops would be in one
/// function and take registers and local memory for both, so along<true> tracks all rays.
template <class Track, class View>
SCOLOPAX_HOT std::optional<Collision> trackWithPatience(const Track& track, const View& scene, const Ray& ray,
                                                        Interval inside, Sampler& sampler, SampleCost* cost) {
  bool stuck = false;
#if defined(__CUDACC__)
  return track.template along<true>(scene, ray, inside, sampler, cost, &stuck);
#else
  const std::uint32_t begin = sampler.blocks();
  if (inside.channels == ~0u) [[likely]] {
    const auto hit = track.template along<false>(scene, ray, inside, sampler, cost, &stuck);
    if (!stuck) [[likely]]
      return hit;
  }
  Sampler rewound = sampler;
  rewound.skipTo(begin);
  const CloselyTracked again = trackClosely(track, scene, ray, inside, rewound);
  sampler.skipTo(again.blocks);
  cost->fetches += again.cost.fetches;
  cost->cellSteps += again.cost.cellSteps;
  cost->truncated |= again.cost.truncated;
  if (!again.hit) return std::nullopt;
  // Member by member: copying the whole keeps every ray's collision in memory (g++ 12).
  const Collision& met = *again.hit;
  return Collision{{met.distance.enter, met.distance.past},
                   {met.point.x, met.point.y, met.point.z},
                   met.channel,
                   met.position};
#endif
}

}  // namespace scolopax::kernel
