// SPDX-License-Identifier: Apache-2.0
// Finds the segments of one ray per lane, in lockstep. segments.h does the same for a single ray, cell by
// cell.
#pragma once
#include <type_traits>

#include "renderer/kernel/point_walk.h"
#include "renderer/kernel/segments.h"

namespace scolopax::kernel {

template <class L, class View>
class PointSegments {
 public:
  using Float = typename L::Float;
  using Int = typename L::Int;
  using Word = typename L::Word;
  using Mask = typename L::Mask;

  SCOLOPAX_LANES PointSegments(SegmentEnds<L, View>& ends, const View& scene, const RayOf<L>& rays,
                               const IntervalOf<L>& inside, std::uint32_t channels, Float offset, float step,
                               CostOf<L>* cost)
      : ends_(ends),
        scene_(scene),
        rays_(rays),
        inside_(inside),
        channels_(channels),
        offset_(offset),
        step_(step),
        cost_(cost),
        walk_(rays, inside_, scene.majorants, inside.channels & Word(channels)) {
    live_ = more_ = walk_.meets();
    counted_ = without(live_, live_);
    if (any(live_)) k_ = firstSegment(walk_.enter()) - 1;
  }

  /// Advances to the next segment that may have extinction for some ray. If there is none, returns false and
  /// an empty segment.
  SCOLOPAX_LANES bool next(Segment<L>& segment) {
    settle();
    for (++k_; any(live_) && !scene_.isCancelled(); ++k_) {
      const Float start = k_ > 0 ? endOf(k_ - 1) : inside_.enter, end = endOf(k_);
      if (!meetsSomething(start, end)) {
        const int first = firstSegment(select(walk_.full(), walk_.enter(), walk_.exit()));
        // Where floats cannot tell segments apart, this loop might never end.
        if (first <= k_ + 1 && ++idle_ > kMaxSegments) giveUp(live_);
        k_ = k_ > first - 1 ? k_ : first - 1;
        continue;
      }
      const bool apart = scene_.majorants.active != nullptr;
      const Mask met = apart ? without(live_, met_ == Word(0u)) : live_;
      const std::uint32_t wanted = apart ? unionOf(met_) : channels_;
      if (last_ != k_ - 1) known_ = 0;
      if ((wanted & ~known_) != 0) sample(start, wanted & ~known_, ends_.from);
      sample(end, wanted, ends_.to);
      last_ = k_;
      known_ = wanted;
      segment = {start, end, wanted, met, apart, met_};
      more_ = live_ & (end < inside_.exit);
      counted_ = met & walk_.full();
      return true;
    }
    segment = {inside_.exit, inside_.exit, 0, live_, false, Word(0u)};
    return false;
  }

  /// Ends the rays that are not in `wants`. Returns whether there may be more segments for some ray.
  SCOLOPAX_LANES bool keep(Mask wants) {
    more_ = more_ & wants;
    return any(more_);
  }

 private:
  /// Finishes the current segment.
  SCOLOPAX_LANES void settle() {
    live_ = more_;
    for (std::uint32_t left = known_; left != 0; left &= left - 1) {
      const int n = lowestBit(left);
      withClassifier(scene_, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA { classifier.passOn(n, ends_); });
    }
    taken_ = taken_ + onesOf(counted_);
    giveUp(live_ & (taken_ > kMaxSegments - 1));
  }
  SCOLOPAX_LANES void giveUp(Mask which) {
    cost_->truncated = maximum(cost_->truncated, Word(onesOf(which)));
    live_ = without(live_, which);
  }

  SCOLOPAX_LANES Float endOf(int segment) const {
    return minimum(inside_.enter + (float(segment) + offset_) * step_, inside_.exit);
  }

  /// Whether any ray may be in a non-empty cell between `start` and `end`. If none is, the walk has advanced
  /// to the next such cell of every ray or some way towards it, and rays that have none left have ended. If
  /// MajorantView::active is null, finding one such ray is enough: voxels are then finite, and extinctions
  /// add up and depend on the value alone, so the segments of the other rays have no extinction.
  SCOLOPAX_LANES bool meetsSomething(Float start, Float end) {
    walk_.jump(start);
    cost_->cellSteps = cost_->cellSteps + Word(onesOf(live_));
    met_ = Word(0u);
    for (;;) {
      const Mask here = live_ & walk_.full() & (walk_.enter() < end);
      if (scene_.majorants.active)
        met_ = met_ | where(here, walk_.active());
      else if (any(here))
        return true;
      walk_.measure();
      // A ray with nothing left ahead may still have crossed something here.
      const Mask rest = walk_.full() | (walk_.exit() < inside_.exit);
      const Mask behind = live_ & rest & (walk_.exit() < end);
      if (!any(behind)) {
        const bool some = scene_.majorants.active && unionOf(met_) != 0;
        if (!some) live_ = live_ & rest;
        return some;
      }
      const Mask moving = behind | without(live_ & rest, walk_.full());
      walk_.advance(moving);
      cost_->cellSteps = cost_->cellSteps + Word(onesOf(moving));
    }
  }

  /// First segment that contains `t` for some ray that has not ended.
  SCOLOPAX_LANES int firstSegment(Float t) const {
    const Float place = (t - inside_.enter) / step_ - offset_ + 1.0f;
    const int k = int(clamp(smallestOf(select(live_, place, Float(kInfinity))), 0.0f, 1e9f));
    // Rounding may have given the next segment.
    return k > 0 && any(live_ & (t < endOf(k - 1))) ? k - 1 : k;
  }

  SCOLOPAX_LANES void sample(Float t, std::uint32_t channels, SegmentEnd<L, View>& at) {
    Float stored[kMaxVisibleChannels];
    const typename L::Vec point = rays_.origin + t * rays_.direction;
    sampleChannels(scene_, channels, point, stored);
    unsigned fetches = 0;
    for (std::uint32_t left = channels; left != 0; left &= left - 1) {
      const int n = lowestBit(left);
      const ChannelView& channel = scene_.channels[n];
      withClassifier(scene_, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA {
        classifier.template sample<L>(channel, scene_.dims, point, stored[n], n, at);
        fetches += channel.field.cost() + classifier.fetches(channel.field, scene_.dims);
      });
    }
    cost_->fetches = cost_->fetches + Word(onesOf(live_)) * Word(fetches);
  }

  SegmentEnds<L, View>& ends_;
  const View& scene_;
  const RayOf<L>& rays_;
  IntervalOf<L> inside_;
  std::uint32_t channels_;
  Float offset_, step_;
  CostOf<L>* cost_;
  PointWalk<L> walk_;
  Mask live_, more_;  // rays that have not ended, and those that continue beyond the segment
  Mask counted_;      // rays for which the segment counts towards kMaxSegments
  Word met_;
  Int taken_{0};
  int k_ = 0, last_ = -2;    // index of the segment, and of the one taken last
  std::uint32_t known_ = 0;  // channels that were sampled at its end
  int idle_ = 0;
};

/// Finds segments cell by cell for one ray, which takes fewer steps, and point by point for many.
template <class L, class View>
using Segments = std::conditional_t<L::kLanes == 1, CellSegments<View>, PointSegments<L, View>>;

}  // namespace scolopax::kernel
