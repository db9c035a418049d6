// SPDX-License-Identifier: Apache-2.0
// Walks one ray per lane from voxel cell to voxel cell, and samples channels on the part of the rays in a
// cell, where every scalar is a cubic.
#pragma once
#include "renderer/kernel/cubic.h"
#include "renderer/kernel/filters.h"
#include "renderer/kernel/point_walk.h"
#include "renderer/kernel/sample_records.h"

namespace scolopax::kernel {

/// Visits the voxel cells along rays, front to back, except those in empty macrocells. Cells longer than a
/// given length are visited in parts.
template <class L>
class VoxelWalk {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Word = typename L::Word;
  using Mask = typename L::Mask;

  /// `macrocells`: those of `channels` (bit n: visible channel n) tell which are empty. Parts are at most
  /// `longest` long, in world units.
  SCOLOPAX_LANES VoxelWalk(const SceneView& scene, const MajorantView& macrocells, const RayOf<L>& rays,
                           const IntervalOf<L>& inside, Word channels, float longest, CostOf<L>* cost)
      : scene_(scene),
        rays_(rays),
        inside_(inside),
        longest_(longest),
        planes_(scene.hasNearest() ? 2.0f : 1.0f),
        cost_(cost),
        walk_(rays, inside_, macrocells, channels) {
    more_ = walk_.meets();
    start_ = end_ = walk_.enter();
    for (int axis = 0; axis < 3; ++axis)
      inverse_[axis] = clamp(1.0f / (rays.direction[axis] * planes_), -kLargestFinite, kLargestFinite);
  }

  /// Moves the rays in `which` to their next cells. Returns those of them that have one.
  SCOLOPAX_LANES Mask next(Mask which) {
    if (scene_.isCancelled()) more_ = without(more_, more_);
    Mask seeking = which & more_;
    start_ = select(seeking, end_, start_);
    for (int idle = 0; any(seeking); ++idle) {
      const Float nearest = minimum(minimum(faceAfter(start_), start_ + longest_), inside_.exit);
      end_ = select(seeking, nearest, end_);
      // At the cell's middle, as its faces may belong to either of two macrocells.
      walk_.jump(where(seeking, 0.5f * (start_ + end_)));
      cost_->cellSteps = cost_->cellSteps + Word(onesOf(seeking));
      const Mask empty = without(seeking, walk_.full());
      if (!any(empty)) break;
      walk_.measure();
      const Mask ends = without(empty, walk_.exit() < inside_.exit);
      more_ = without(more_, ends);
      seeking = without(empty, ends);
      // All of the cell is empty, so that a ray moves on even where rounding has put the exit before it.
      start_ = select(seeking, maximum(walk_.exit(), end_), start_);
      if (idle > kMaxSegments) {
        giveUp(seeking);
        break;
      }
    }
    const Mask found = which & more_;
    more_ = without(more_, without(found, end_ < inside_.exit));
    taken_ = taken_ + onesOf(found);
    giveUp(found & more_ & (taken_ > kMaxSegments - 1));
    return found;
  }
  /// Ends the rays that are not in `wants`. Returns whether there may be more cells for some ray.
  SCOLOPAX_LANES bool keep(Mask wants) {
    more_ = more_ & wants;
    return any(more_);
  }

  /// Rays that go on beyond their cell.
  SCOLOPAX_LANES Mask more() const { return more_; }

  /// The part of each ray in its cell.
  SCOLOPAX_LANES Float start() const { return start_; }
  SCOLOPAX_LANES Float end() const { return end_; }
  /// Bits of the channels that the cell's macrocell has; only if it has MajorantView::active.
  SCOLOPAX_LANES Word active() const { return walk_.active(); }

 private:
  SCOLOPAX_LANES void giveUp(Mask which) {
    cost_->truncated = maximum(cost_->truncated, Word(onesOf(which)));
    more_ = without(more_, which);
  }

  /// Where each ray meets the next plane through voxel centres after t or, with nearest-voxel interpolation,
  /// the next one through them or between them.
  SCOLOPAX_LANES Float faceAfter(Float t) const {
    Float face(kInfinity);
    for (int axis = 0; axis < 3; ++axis) {
      const Float o = rays_.origin[axis] * planes_, d = rays_.direction[axis] * planes_;
      const Mask up = d > 0.0f;
      const Float last = toFloat(Int(scene_.dims[axis] - 1)) * planes_,
                  way = select(up, Float(1.0f), Float(-1.0f));
      const Float x = clamp(o + t * d, -1.0f, last + 1.0f);
      const Float floor = toFloat(truncated(x + 1.0f)) - 1.0f;
      const Float plane = select(up, floor + 1.0f, select(floor == x, floor - 1.0f, floor));
      // Rounding may have put the point on the wrong side of the plane.
      const Float first = crossingOf(axis, plane, last), second = crossingOf(axis, plane + way, last);
      face = minimum(face, select(first > t, first, select(second > t, second, Float(kInfinity))));
    }
    return face;
  }
  /// Infinite if there is no such plane.
  SCOLOPAX_LANES Float crossingOf(int axis, Float plane, Float last) const {
    const Mask exists = (plane >= 0.0f) & (plane <= last);
    return select(exists, (plane - rays_.origin[axis] * planes_) * inverse_[axis], Float(kInfinity));
  }

  const SceneView& scene_;
  const RayOf<L>& rays_;
  IntervalOf<L> inside_;
  float longest_;
  float planes_;  // per voxel
  CostOf<L>* cost_;
  PointWalk<L> walk_;
  Mask more_;  // rays that have not ended, and go on beyond their cell
  Float start_, end_;
  Float inverse_[3];
  Int taken_{0};
};

/// Samples a field whose filter is not trilinear at the nodes of a cubic, which are around `centre`.
template <class L>
SCOLOPAX_LANES_RARE void sampleNodes(const FieldView& field, glm::ivec3 dims, const typename L::Vec& centre,
                                     const typename L::Vec* points, typename L::Float* stored) {
  // The nodes may be on the plane at which the nearest voxel changes.
  const bool nearest = field.has(Filter::nearest);
  for (int i = 0; i < kCubicNodes; ++i) sampleFiltered(field, dims, nearest ? centre : points[i], &stored[i]);
}

/// What sampleCubics() costs for a field, in trilinear samples. One reading of eight voxels serves all nodes.
SCOLOPAX_HD inline unsigned cubicFetches(const FieldView& field) {
  return field.has(Filter::cubic) ? kCubicNodes * field.cost() : 1;
}

/// Samples `channels` at the nodes of a cubic on the parts of rays from `start` to `end`, each in a cell of
/// eight voxels and, with nearest-voxel interpolation, nearest to one of them. Calls visit(n, points, values)
/// for every channel: the nodes in voxel coordinates, and stored values less the channel's
/// origin; NaN where a value is not finite. Trilinear interpolation is a cubic there, and the nearest voxel's
/// value a constant; the cubic B-spline is of degree 9, so that the cubic through its nodes approximates it.
template <class L, class Visit>
SCOLOPAX_LANES void sampleCubics(const SceneView& scene, const RayOf<L>& rays, std::uint32_t channels,
                                 typename L::Float start, typename L::Float end, Visit&& visit) {
  using Float = typename L::Float;
  using Vec = typename L::Vec;
  constexpr float kFarValue = 0x1p124f;  // as voxels; coefficients of a cubic are below 12 times that
  // Many rays read channels together. A single ray keeps the voxels of one channel in registers instead: a
  // device would keep those of all channels in memory.
  constexpr bool kTogether = L::kLanes > 1;
  Float corners[kTogether ? kMaxVisibleChannels : 1][kCorners];
  std::uint32_t trilinear = 0;
  for (std::uint32_t left = channels; left != 0; left &= left - 1)
    if (scene.channels[lowestBit(left)].field.has(Filter::trilinear)) trilinear |= left & -left;
  const Float middle = 0.5f * (start + end), half = 0.5f * (end - start);
  const Vec centre = rays.origin + middle * rays.direction;
  if constexpr (kTogether) cellVoxels(scene, trilinear, centre, corners);
  const CellPlaces<L> cell(scene.dims, centre);
  Vec points[kCubicNodes], places[kCubicNodes];
  for (int i = 0; i < kCubicNodes; ++i) {
    points[i] = rays.origin + (middle + half * cubicNode(i)) * rays.direction;
    places[i] = cell.of(points[i]);
  }
  for (std::uint32_t left = channels; left != 0; left &= left - 1) {
    const int n = lowestBit(left);
    const ChannelView& channel = scene.channels[n];
    Float stored[kCubicNodes], values[kCubicNodes];
    if (trilinear >> n & 1) [[likely]] {
      if constexpr (!kTogether) cellVoxels(channel.field, scene.dims, centre, corners[0]);
      for (int i = 0; i < kCubicNodes; ++i) stored[i] = interpolate<L>(corners[kTogether ? n : 0], places[i]);
    } else {
      sampleNodes<L>(channel.field, scene.dims, centre, points, stored);
    }
    for (int i = 0; i < kCubicNodes; ++i) {
      const Float value = clamp(stored[i] - channel.origin, -kFarValue, kFarValue);
      values[i] = select(isFinite(stored[i]), value, Float(kNaN));
    }
    visit(n, points, values);
  }
}

}  // namespace scolopax::kernel
