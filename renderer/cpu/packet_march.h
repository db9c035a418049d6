// SPDX-License-Identifier: Apache-2.0
// Eight rays cut into the same segments as by kernel/segments.h, in step with each other.
#pragma once
#include "renderer/cpu/packet_parts.h"
#include "renderer/cpu/packet_walk.h"
#include "renderer/cpu/sample_lanes.h"
#if defined(__x86_64__)

namespace scolopax::lanes {

/// kernel::SampleCost of eight rays.
struct PacketCost {
  Int fetches, cellSteps, randomBlocks, truncated;
};
SCOLOPAX_AVX2 PacketCost noCost() { return {ints(0), ints(0), ints(0), ints(0)}; }

/// A segment of every ray and where channels are on it.
struct PacketSegment {
  Float start, end;
  const Place *from, *to;  ///< per channel
  Mask live;               ///< the other rays have ended
};

class PacketMarch {
 public:
  /// Channels by their bits; ray i takes segments as kernel::SegmentWalk does with offset and step.
  SCOLOPAX_AVX2 PacketMarch(const kernel::SceneView& scene, const Rays& rays, const Intervals& inside,
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
  SCOLOPAX_AVX2 void follow(Sink& sink) {
    PacketWalk walk(rays_, inside_, scene_.majorants);
    live_ = walk.meets();
    if (!any(live_)) return;
    int sampled = -2;  // segment whose end was sampled last
    int looked = 0;
    for (int k = firstSegment(walk.enter()); any(live_);) {
      // Also where segments are too many for floats to tell them apart.
      if (++looked > kernel::kMaxSegments) {
        cost_->truncated = cost_->truncated + onesOf(live_);
        break;
      }
      const Float start = k > 0 ? endOf(k - 1) : inside_.enter, end = endOf(k);
      if (!meetsSomething(walk, start, end)) {
        k = std::max(k + 1, firstSegment(select(walk.full(), walk.enter(), walk.exit())));
        continue;
      }
      if (sampled != k - 1) sample(start, from_);
      sampled = k;
      sample(end, to_);
      live_ = sink.take({start, end, from_, to_, live_}) & live_ & (end < inside_.exit);
      for (int n = 0; n < scene_.channelCount; ++n)
        if (channels_ >> n & 1) from_[n] = to_[n];
      ++k;
    }
  }

 private:
  SCOLOPAX_AVX2 Float endOf(int segment) const {
    return minimum(inside_.enter + (floats(float(segment)) + offset_) * step_, inside_.exit);
  }

  /// Whether a ray is in a cell that is not empty between these places. If none is, the walk has gone on to
  /// the next such cell of every ray or some way there, and rays that have none left have ended.
  SCOLOPAX_AVX2 bool meetsSomething(PacketWalk& walk, Float start, Float end) {
    walk.jump(start);
    cost_->cellSteps = cost_->cellSteps + onesOf(live_);
    for (;;) {
      if (any(live_ & walk.full() & (walk.enter() < end))) return true;
      walk.measure();
      live_ = live_ & (walk.full() | (walk.exit() < inside_.exit));
      if (!any(live_ & (walk.exit() < end))) return false;
      const Mask moving = without(live_, walk.full());
      walk.advance(moving);
      cost_->cellSteps = cost_->cellSteps + onesOf(moving);
    }
  }

  /// First segment that has one of these points, of rays that have not ended.
  SCOLOPAX_AVX2 int firstSegment(Float t) const {
    const Float place = (t - inside_.enter) / step_ - offset_ + floats(1.0f);
    return int(kernel::clamp(smallestOf(select(live_, place, floats(kernel::kInfinity))), 0.0f, 1e9f));
  }

  SCOLOPAX_AVX2 void sample(Float t, Place* places) {
    float stored[kernel::kMaxVisibleChannels][kLanes];
    sampleLanes(scene_, channels_, rays_.origin[0] + t * rays_.direction[0],
                rays_.origin[1] + t * rays_.direction[1], rays_.origin[2] + t * rays_.direction[2], stored);
    int count = 0;
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(channels_ >> n & 1)) continue;
      const kernel::ChannelView& channel = scene_.channels[n];
      places[n].position = positionsOf(channel, stored[n]);
      places[n].piece = piecesAt(channel.optical, places[n].position);
      ++count;
    }
    cost_->fetches = cost_->fetches + onesOf(live_) * ints(count);
  }

  /// kernel::stretchPosition.
  SCOLOPAX_AVX2 static Float positionsOf(const kernel::ChannelView& channel, const float* stored) {
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
  Place from_[kernel::kMaxVisibleChannels], to_[kernel::kMaxVisibleChannels];
};

}  // namespace scolopax::lanes
#endif
