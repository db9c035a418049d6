// SPDX-License-Identifier: Apache-2.0
// A packet of rays, one a lane, cut into the same segments as by kernel/segments.h, in step with each other.
#pragma once
#include "renderer/cpu/packet_parts.h"
#include "renderer/cpu/packet_walk.h"
#include "renderer/cpu/sample_lanes.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// kernel::SampleCost of every ray.
struct PacketCost {
  Int fetches, cellSteps, randomBlocks, truncated;
};
SCOLOPAX_SIMD PacketCost noCost() { return {ints(0), ints(0), ints(0), ints(0)}; }

/// A segment of every ray and where channels are on it.
struct PacketSegment {
  Float start, end;
  std::uint32_t channels;  ///< bit n: channel n may have extinction for some ray; the others have none
  const Place *from, *to;  ///< per channel
  Mask live;               ///< the other rays have ended
  const Int* met;          ///< bits of columns that may have extinction, or null where nobody has asked

  /// Rays for which channel n may have extinction.
  SCOLOPAX_SIMD Mask of(const kernel::SceneView& scene, int n) const {
    if (!met) return live;
    const Int bit = ints(int(1u << scene.majorants.tables[n].column));
    return live & ((*met & bit) == bit);
  }
};

class PacketMarch {
 public:
  /// Channels by their bits; ray i takes segments as kernel::SegmentWalk does with offset and step.
  SCOLOPAX_SIMD PacketMarch(const kernel::SceneView& scene, const Rays& rays, const Intervals& inside,
                            std::uint32_t channels, Float offset, float step, PacketCost* cost)
      : scene_(scene),
        rays_(rays),
        inside_(inside),
        channels_(channels),
        offset_(offset),
        step_(floats(step)),
        cost_(cost) {}

  /// sink.take(segment), for all that may have extinction, returns the rays that want more.
  template <class Sink>
  SCOLOPAX_SIMD void follow(Sink& sink) {
    PacketWalk walk(rays_, inside_, scene_.majorants, columns());
    live_ = walk.meets();
    if (!any(live_)) return;
    int last = -2;            // segment taken last
    std::uint32_t known = 0;  // channels that were sampled at its end
    Int taken = ints(0);
    int idle = 0;
    for (int k = firstSegment(walk.enter()); any(live_); ++k) {
      const Float start = k > 0 ? endOf(k - 1) : inside_.enter, end = endOf(k);
      Mask met = live_;
      if (!meetsSomething(walk, start, end)) {
        const int first = firstSegment(select(walk.full(), walk.enter(), walk.exit()));
        // Where floats cannot tell segments apart there may be no end of them.
        if (first <= k + 1 && ++idle > kernel::kMaxSegments) giveUp(live_);
        k = std::max(k, first - 1);
        continue;
      }
      if (scene_.majorants.active) met = without(met, met_ == ints(0));
      const std::uint32_t wanted = scene_.majorants.active ? channelsOf(unionOf(met_)) : channels_;
      if (last != k - 1) known = 0;
      if ((wanted & ~known) != 0) sample(start, wanted & ~known, from_);
      last = k;
      known = wanted;
      sample(end, wanted, to_);
      const PacketSegment segment{
          start, end, wanted, from_, to_, met, scene_.majorants.active ? &met_ : nullptr};
      live_ = live_ & (sink.take(segment) & (end < inside_.exit));
      for (std::uint32_t left = wanted; left != 0; left &= left - 1)
        from_[std::countr_zero(left)] = to_[std::countr_zero(left)];
      taken = taken + onesOf(met & walk.full());
      giveUp(live_ & (taken > ints(kernel::kMaxSegments - 1)));
    }
  }

 private:
  SCOLOPAX_SIMD void giveUp(Mask which) {
    cost_->truncated = maximum(cost_->truncated, onesOf(which));
    live_ = without(live_, which);
  }

  std::uint32_t columns() const {
    std::uint32_t columns = 0;
    for (std::uint32_t left = channels_; left != 0; left &= left - 1)
      columns |= 1u << scene_.majorants.tables[std::countr_zero(left)].column;
    return columns;
  }
  std::uint32_t channelsOf(std::uint32_t columns) const {
    std::uint32_t channels = 0;
    for (std::uint32_t left = channels_; left != 0; left &= left - 1) {
      const int n = std::countr_zero(left);
      channels |= (columns >> scene_.majorants.tables[n].column & 1) << n;
    }
    return channels;
  }

  SCOLOPAX_SIMD Float endOf(int segment) const {
    return minimum(inside_.enter + (floats(float(segment)) + offset_) * step_, inside_.exit);
  }

  /// Whether a ray may be in a cell that is not empty between these places. If none is, the walk has gone on
  /// to the next such cell of every ray or some way there; rays that have none left end. Without bits of
  /// channels the first such ray is enough: where voxels are finite, the others' segments are continuous and
  /// have no extinction.
  SCOLOPAX_SIMD bool meetsSomething(PacketWalk& walk, Float start, Float end) {
    walk.jump(start);
    cost_->cellSteps = cost_->cellSteps + onesOf(live_);
    met_ = ints(0);
    for (;;) {
      const Mask here = live_ & walk.full() & (walk.enter() < end);
      if (scene_.majorants.active)
        met_ = met_ | where(here, walk.active());
      else if (any(here))
        return true;
      walk.measure();
      // What has nothing left may still have met something.
      const Mask rest = walk.full() | (walk.exit() < inside_.exit);
      const Mask behind = live_ & rest & (walk.exit() < end);
      if (!any(behind)) {
        const bool some = scene_.majorants.active && unionOf(met_) != 0;
        if (!some) live_ = live_ & rest;
        return some;
      }
      const Mask moving = behind | without(live_ & rest, walk.full());
      walk.advance(moving);
      cost_->cellSteps = cost_->cellSteps + onesOf(moving);
    }
  }

  /// First segment that has one of these points, of rays that have not ended.
  SCOLOPAX_SIMD int firstSegment(Float t) const {
    const Float place = (t - inside_.enter) / step_ - offset_ + floats(1.0f);
    const float first = smallestOf(select(live_, place, floats(kernel::kInfinity)));
    const int k = int(kernel::clamp(first, 0.0f, 1e9f));
    // Rounding may have come to the next.
    return k > 0 && any(live_ & (t < endOf(k - 1))) ? k - 1 : k;
  }

  SCOLOPAX_SIMD void sample(Float t, std::uint32_t channels, Place* places) {
    float stored[kernel::kMaxVisibleChannels][kLanes];
    sampleLanes(scene_, channels, rays_.origin[0] + t * rays_.direction[0],
                rays_.origin[1] + t * rays_.direction[1], rays_.origin[2] + t * rays_.direction[2], stored);
    for (std::uint32_t left = channels; left != 0; left &= left - 1) {
      const int n = std::countr_zero(left);
      const kernel::ChannelView& channel = scene_.channels[n];
      places[n].position = positionsOf(channel, stored[n]);
      places[n].piece = piecesAt(channel.optical, places[n].position);
    }
    cost_->fetches = cost_->fetches + onesOf(live_) * ints(std::popcount(channels));
  }

  /// kernel::stretchPosition.
  SCOLOPAX_SIMD static Float positionsOf(const kernel::ChannelView& channel, const float* stored) {
    if (channel.gamma != 1.0f) {
      float positions[kLanes];
      for (int i = 0; i < kLanes; ++i) positions[i] = kernel::stretchPosition(channel, stored[i]);
      return load(positions);
    }
    const Float value = load(stored), far = floats(1e6f);
    const Float position =
        clamp((value - floats(channel.origin)) * floats(channel.scale) + floats(channel.offset),
              negative(far), far);
    return select(isFinite(value), position, floats(__builtin_nanf("")));
  }

  const kernel::SceneView& scene_;
  const Rays& rays_;
  const Intervals& inside_;
  std::uint32_t channels_;
  Float offset_, step_;
  PacketCost* cost_;
  Mask live_;
  Int met_;
  Place from_[kernel::kMaxVisibleChannels], to_[kernel::kMaxVisibleChannels];
};

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
