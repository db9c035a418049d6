// SPDX-License-Identifier: Apache-2.0
// Cuts one ray per lane at the faces of voxel cells, and skips the cells in empty macrocells. On such a
// segment, every scalar is a cubic.
#pragma once
#include "renderer/kernel/point_walk.h"
#include "renderer/kernel/segment_cubics.h"
#include "renderer/kernel/segments.h"

namespace scolopax::kernel {

template <class L, class View>
class VoxelSegments {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Word = typename L::Word;
  using Mask = typename L::Mask;
  using Vec = typename L::Vec;

  /// Segments are at most `longest` long, in world units.
  SCOLOPAX_LANES VoxelSegments(SegmentCubics<L, View>& scalars, const View& scene, const RayOf<L>& rays,
                               const IntervalOf<L>& inside, std::uint32_t channels, Float, float longest,
                               CostOf<L>* cost)
      : scalars_(scalars),
        scene_(scene),
        rays_(rays),
        inside_(inside),
        channels_(channels),
        longest_(longest),
        cost_(cost),
        walk_(rays, inside_, scene.majorants, inside.channels & Word(channels)) {
    live_ = more_ = walk_.meets();
    start_ = walk_.enter();
    for (int axis = 0; axis < 3; ++axis)
      inverse_[axis] = clamp(1.0f / rays.direction[axis], -kLargestFinite, kLargestFinite);
  }

  /// Advances to the next segment that may have extinction for some ray. If there is none, returns false and
  /// an empty segment.
  SCOLOPAX_LANES bool next(Segment<L>& segment) {
    live_ = more_;
    if (!findCell()) {
      segment = {inside_.exit, inside_.exit, 0, live_, false, Word(0u)};
      return false;
    }
    const bool apart = scene_.majorants.active != nullptr;
    const Word met = apart ? where(live_, walk_.active()) : Word(0u);
    const std::uint32_t wanted = apart ? unionOf(met) : channels_;
    sample(wanted);
    segment = {start_, end_, wanted, live_, apart, met};
    more_ = live_ & (end_ < inside_.exit);
    start_ = select(live_, end_, start_);
    taken_ = taken_ + onesOf(live_);
    giveUp(more_ & (taken_ > kMaxSegments - 1));
    return true;
  }

  /// Ends the rays that are not in `wants`. Returns whether there may be more segments for some ray.
  SCOLOPAX_LANES bool keep(Mask wants) {
    more_ = more_ & wants;
    return any(more_);
  }

 private:
  SCOLOPAX_LANES void giveUp(Mask which) {
    cost_->truncated = maximum(cost_->truncated, Word(onesOf(which)));
    more_ = without(more_, which);
  }

  /// Moves every ray to a cell in a macrocell that is not empty. Returns false if no ray has one.
  SCOLOPAX_LANES bool findCell() {
    for (int idle = 0; any(live_); ++idle) {
      end_ = minimum(minimum(faceAfter(start_), start_ + longest_), inside_.exit);
      // At the cell's middle, as its faces may belong to either of two macrocells.
      walk_.jump(where(live_, 0.5f * (start_ + end_)));
      cost_->cellSteps = cost_->cellSteps + Word(onesOf(live_));
      const Mask empty = without(live_, walk_.full());
      if (!any(empty)) return true;
      walk_.measure();
      const Mask ends = without(empty, walk_.exit() < inside_.exit);
      const Mask moving = without(empty, ends);
      live_ = more_ = without(live_, ends);
      // All of the cell is empty, so that a ray moves on even where rounding has put the exit before it.
      start_ = select(moving, maximum(walk_.exit(), end_), start_);
      if (idle > kMaxSegments) {
        giveUp(moving);
        live_ = more_;
      }
    }
    return false;
  }

  /// Where each ray meets the next plane through voxel centres after t.
  SCOLOPAX_LANES Float faceAfter(Float t) const {
    Float face(kInfinity);
    for (int axis = 0; axis < 3; ++axis) {
      const Float o = rays_.origin[axis], d = rays_.direction[axis];
      const Mask up = d > 0.0f;
      const Float last = toFloat(Int(scene_.dims[axis] - 1)), way = select(up, Float(1.0f), Float(-1.0f));
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
    return select(exists, (plane - rays_.origin[axis]) * inverse_[axis], Float(kInfinity));
  }

  SCOLOPAX_LANES void sample(std::uint32_t channels) {
    constexpr float kFarPlace = 0x1p124f;  // as voxels; coefficients of a cubic are below 12 times that
    Float corners[kMaxVisibleChannels][kCorners];
    const Float middle = 0.5f * (start_ + end_), half = 0.5f * (end_ - start_);
    const Vec centre = rays_.origin + middle * rays_.direction;
    cellVoxels(scene_, channels, centre, corners);
    const CellPlaces<L> cell(scene_.dims, centre);
    Vec points[kCubicNodes], places[kCubicNodes];
    for (int i = 0; i < kCubicNodes; ++i) {
      points[i] = rays_.origin + (middle + half * kCubicNode[i]) * rays_.direction;
      places[i] = cell.of(points[i]);
    }
    unsigned fetches = 0;
    for (std::uint32_t left = channels; left != 0; left &= left - 1) {
      const int n = std::countr_zero(left);
      const ChannelView& channel = scene_.channels[n];
      Float values[kCubicNodes];
      for (int i = 0; i < kCubicNodes; ++i) {
        const Float stored = interpolate<L>(corners[n], places[i]), away = stored - channel.origin;
        const Float place = clamp(channel.scale < 0.0f ? -away : away, -kFarPlace, kFarPlace);
        values[i] = select(isFinite(stored), place, Float(kNaN));
      }
      scalars_.place[n] = cubicThrough<L>(values);
      ++fetches;
      if (scene_.hasFactor(n)) [[unlikely]] {
        for (int i = 0; i < kCubicNodes; ++i)
          findFactorPosition<L>(channel, scene_.dims, points[i], &values[i]);
        scalars_.factorPosition[n] = cubicThrough<L>(values);
        fetches += kCubicNodes * gradientFetches(scene_.dims);
      }
    }
    cost_->fetches = cost_->fetches + Word(onesOf(live_)) * Word(fetches);
  }

  SegmentCubics<L, View>& scalars_;
  const View& scene_;
  const RayOf<L>& rays_;
  IntervalOf<L> inside_;
  std::uint32_t channels_;
  float longest_;
  CostOf<L>* cost_;
  PointWalk<L> walk_;
  Mask live_, more_;  // rays that have not ended, and those that continue beyond the segment
  Float start_, end_;
  Float inverse_[3];
  Int taken_{0};
};

}  // namespace scolopax::kernel
