// SPDX-License-Identifier: Apache-2.0
// Cuts one ray per lane at the faces of voxel cells, and skips the cells in empty macrocells. On such a
// segment, every scalar is a cubic.
#pragma once
#include "renderer/kernel/segment_cubics.h"
#include "renderer/kernel/segments.h"
#include "renderer/kernel/voxel_walk.h"

namespace scolopax::kernel {

template <class L, class View>
class VoxelSegments {
 public:
  using Float = typename L::Float;
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
        exit_(inside.exit),
        channels_(channels),
        cost_(cost),
        walk_(scene, scene.majorants, rays, inside, inside.channels & Word(channels), longest, cost) {}

  /// Advances to the next segment that may have extinction for some ray. If there is none, returns false and
  /// an empty segment.
  SCOLOPAX_LANES bool next(Segment<L>& segment) {
    const Mask live = walk_.next(L::everywhere());
    if (!any(live)) {
      segment = {exit_, exit_, 0, live, false, Word(0u)};
      return false;
    }
    const bool apart = scene_.majorants.active != nullptr;
    const Word met = apart ? where(live, walk_.active()) : Word(0u);
    const std::uint32_t wanted = apart ? unionOf(met) : channels_;
    segment = {walk_.start(), walk_.end(), wanted, live, apart, met};
    sample(segment);
    return true;
  }

  /// Ends the rays that are not in `wants`. Returns whether there may be more segments for some ray.
  SCOLOPAX_LANES bool keep(Mask wants) { return walk_.keep(wants); }

 private:
  SCOLOPAX_LANES void sample(const Segment<L>& segment) {
    unsigned fetches = 0;
    sampleCubics<L>(scene_, rays_, segment.channels, segment.start, segment.end,
                    [&](int n, const Vec* points, const Float* values) SCOLOPAX_LANES_LAMBDA {
                      const ChannelView& channel = scene_.channels[n];
                      Float own[kCubicNodes];
                      for (int i = 0; i < kCubicNodes; ++i)
                        own[i] = channel.scale < 0.0f ? -values[i] : values[i];
                      scalars_.place[n] = cubicThrough<L>(own);
                      ++fetches;
                      if (scene_.hasFactor(n)) [[unlikely]] {
                        for (int i = 0; i < kCubicNodes; ++i)
                          findFactorPosition<L>(channel, scene_.dims, points[i], &own[i]);
                        scalars_.factorPosition[n] = cubicThrough<L>(own);
                        fetches += kCubicNodes * gradientFetches(scene_.dims);
                      }
                    });
    cost_->fetches = cost_->fetches + Word(onesOf(segment.live)) * Word(fetches);
  }

  SegmentCubics<L, View>& scalars_;
  const View& scene_;
  const RayOf<L>& rays_;
  Float exit_;
  std::uint32_t channels_;
  CostOf<L>* cost_;
  VoxelWalk<L> walk_;
};

}  // namespace scolopax::kernel
