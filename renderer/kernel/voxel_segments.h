// SPDX-License-Identifier: Apache-2.0
// Cuts one ray per lane at the faces of voxel cells, and skips the cells in empty macrocells. On such a
// segment, every scalar is a cubic. Segments of dense matter are divided further.
#pragma once
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
    const Mask within = wants_ & (to_ < 1.0f), enters = walk_.next(without(wants_, within));
    live_ = within | enters;
    if (!any(live_)) {
      segment = {exit_, exit_, 0, live_, false, Word(0u)};
      return false;
    }
    const bool apart = scene_.majorants.active != nullptr;
    if (any(enters)) {
      if (apart) met_ = select(enters, walk_.active(), met_);
      sample(enters, apart ? unionOf(where(enters, met_)) : channels_);
    }
    // After a part, one of twice its length.
    from_ = select(enters, Float(-1.0f), to_);
    to_ = select(enters, Float(1.0f), minimum(from_ + 2.0f * way_, 1.0f));
    const Word met = apart ? where(live_, met_) : Word(0u);
    segment = {exit_, exit_, apart ? unionOf(met) : channels_, live_, apart, met};
    setPart(segment);
    return true;
  }

  /// Ends the rays that are not in `wants`. Returns whether there may be more segments for some ray.
  SCOLOPAX_LANES bool keep(Mask wants) {
    wants_ = wants_ & wants;
    walk_.keep(wants_);
    return any(wants_ & (walk_.more() | (to_ < 1.0f)));
  }

  /// Shortens segments whose optical depth is above `most`, because they hide much of their own far end.
  /// Where the transmittance in front of a segment is `left`, it may be deeper by the fourth root of 1 /
  /// left: the error of a segment is of third order in its depth, so that the cube root would give the least
  /// error for a number of segments; the fourth root is almost as good and needs no power(). Returns false,
  /// and changes nothing, if no segment is too deep.
  SCOLOPAX_LANES bool shorten(Segment<L>& segment, Float depth, Float left, float most) {
    Mask thick = live_ & (depth > most) & (way_ > kShortest);
    if (!any(thick)) return false;
    depth = depth * squareRoot(squareRoot(left));
    thick = thick & (depth > most);
    if (!any(thick)) return false;
    to_ = select(thick, from_ + way_ * maximum(0.9f * most / depth, kMostDivision), to_);
    setPart(segment);
    return true;
  }

 private:
  static constexpr float kShortest = 0x1p-18f, kMostDivision = 0x1p-6f;

  /// Samples the cells of the rays in `which`.
  SCOLOPAX_LANES void sample(Mask which, std::uint32_t channels) {
    unsigned fetches = 0;
    sampleCubics<L>(scene_, rays_, channels, walk_.start(), walk_.end(),
                    [&](int n, const Vec* points, const Float* values) SCOLOPAX_LANES_LAMBDA {
                      const ChannelView& channel = scene_.channels[n];
                      withClassifier(scene_, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA {
                        classifier.template sample<L>(channel, scene_.dims, points, values, which, n, cell_);
                        fetches += cubicFetches(channel.field) +
                                   kCubicNodes * classifier.fetches(channel.field, scene_.dims);
                      });
                    });
    cost_->fetches = cost_->fetches + Word(onesOf(which)) * Word(fetches);
  }

  /// Sets the segment and its scalars to the parts of the cells from from_ to to_.
  SCOLOPAX_LANES void setPart(Segment<L>& segment) {
    const Float begin = walk_.start(), end = walk_.end();
    const Float centre = 0.5f * (begin + end), reach = 0.5f * (end - begin);
    way_ = to_ - from_;
    segment.start = select(from_ > -1.0f, centre + reach * from_, begin);
    segment.end = select(to_ < 1.0f, centre + reach * to_, end);
    const Float middle = 0.5f * (from_ + to_), half = 0.5f * way_;
    for (std::uint32_t left = segment.channels; left != 0; left &= left - 1) {
      const int n = lowestBit(left);
      withClassifier(scene_, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA {
        classifier.template cutPart<L>(cell_, middle, half, n, scalars_);
      });
    }
  }

  SegmentCubics<L, View>& scalars_;
  const View& scene_;
  const RayOf<L>& rays_;
  Float exit_;
  std::uint32_t channels_;
  CostOf<L>* cost_;
  VoxelWalk<L> walk_;
  SegmentCubics<L, View> cell_;  // of whole cells
  Mask wants_ = L::everywhere(), live_;
  Float from_{-1.0f}, to_{1.0f}, way_{2.0f};  // the segments, as parts of the cells from -1 to 1
  Word met_{0u};
};

}  // namespace scolopax::kernel
