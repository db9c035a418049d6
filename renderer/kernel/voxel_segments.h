// SPDX-License-Identifier: Apache-2.0
// Cuts one ray per lane at the faces of voxel cells, and skips the cells in empty macrocells. On such a
// segment, every scalar is a cubic. Segments of dense matter are divided further.
#pragma once
#include "renderer/kernel/segments.h"
#include "renderer/kernel/voxel_walk.h"

namespace scolopax::kernel {

/// Cuts rays into whole cells.
template <class L, class View>
class WholeVoxelSegments {
 public:
  using Float = typename L::Float;
  using Word = typename L::Word;
  using Mask = typename L::Mask;
  using Vec = typename L::Vec;

  /// Segments are at most `longest` long, in world units.
  SCOLOPAX_LANES WholeVoxelSegments(SegmentCubics<L, View>& scalars, const View& scene, const RayOf<L>& rays,
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
    segment = of(enter(wants_));
    if (!any(segment.live)) return false;
    segment.start = walk_.start();
    segment.end = walk_.end();
    return true;
  }
  /// Ends the rays that are not in `wants`. Returns whether there may be more segments for some ray.
  SCOLOPAX_LANES bool keep(Mask wants) {
    wants_ = wants_ & wants;
    walk_.keep(wants_);
    return any(wants_ & walk_.more());
  }

  /// Moves the rays in `which` to their next cells, and samples these. Returns those of them that have one.
  SCOLOPAX_LANES Mask enter(Mask which) {
    const Mask enters = walk_.next(which);
    if (!any(enters)) return enters;
    if (isApart()) met_ = select(enters, walk_.active(), met_);
    sample(enters, isApart() ? unionOf(where(enters, met_)) : channels_);
    return enters;
  }
  /// A segment of the rays in `live`, in their cells; still empty.
  SCOLOPAX_LANES Segment<L> of(Mask live) const {
    if (!any(live)) return {exit_, exit_, 0, live, false, Word(0u)};
    const Word met = isApart() ? where(live, met_) : Word(0u);
    return {exit_, exit_, isApart() ? unionOf(met) : channels_, live, isApart(), met};
  }
  SCOLOPAX_LANES Mask wants() const { return wants_; }
  SCOLOPAX_LANES const VoxelWalk<L>& walk() const { return walk_; }

 private:
  SCOLOPAX_LANES bool isApart() const { return scene_.majorants.active != nullptr; }

  SCOLOPAX_LANES void sample(Mask which, std::uint32_t channels) {
    unsigned fetches = 0;
    sampleCubics<L>(
        scene_, rays_, channels, walk_.start(), walk_.end(),
        [&](int n, const Vec* points, const Float* values) SCOLOPAX_LANES_LAMBDA {
          const ChannelView& channel = scene_.channels[n];
          withClassifier(scene_, n, [&](auto classifier) SCOLOPAX_LANES_LAMBDA {
            classifier.template sample<L>(channel, scene_.dims, points, values, which, n, scalars_);
            fetches +=
                cubicFetches(channel.field) + kCubicNodes * classifier.fetches(channel.field, scene_.dims);
          });
        });
    cost_->fetches = cost_->fetches + Word(onesOf(which)) * Word(fetches);
  }

  SegmentCubics<L, View>& scalars_;
  const View& scene_;
  const RayOf<L>& rays_;
  Float exit_;
  std::uint32_t channels_;
  CostOf<L>* cost_;
  VoxelWalk<L> walk_;
  Mask wants_ = L::everywhere();
  Word met_{0u};
};

/// Cuts rays into cells, and these into parts if they are shortened.
template <class L, class View>
class VoxelSegments {
 public:
  using Float = typename L::Float;
  using Mask = typename L::Mask;

  /// Arguments as those of WholeVoxelSegments.
  SCOLOPAX_LANES VoxelSegments(SegmentCubics<L, View>& scalars, const View& scene, const RayOf<L>& rays,
                               const IntervalOf<L>& inside, std::uint32_t channels, Float offset,
                               float longest, CostOf<L>* cost)
      : scalars_(scalars),
        scene_(scene),
        whole_(cell_, scene, rays, inside, channels, offset, longest, cost) {}

  /// Advances to the next segment that may have extinction for some ray. If there is none, returns false and
  /// an empty segment.
  SCOLOPAX_LANES bool next(Segment<L>& segment) {
    const Mask within = whole_.wants() & (to_ < 1.0f), enters = whole_.enter(without(whole_.wants(), within));
    live_ = within | enters;
    segment = whole_.of(live_);
    if (!any(live_)) return false;
    // After a part, one of twice its length.
    from_ = select(enters, Float(-1.0f), to_);
    to_ = select(enters, Float(1.0f), minimum(from_ + 2.0f * way_, 1.0f));
    setPart(segment);
    return true;
  }

  /// Ends the rays that are not in `wants`. Returns whether there may be more segments for some ray.
  SCOLOPAX_LANES bool keep(Mask wants) {
    const bool more = whole_.keep(wants);
    return more || any(whole_.wants() & (to_ < 1.0f));
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

  /// Sets the segment and its scalars to the parts of the cells from from_ to to_.
  SCOLOPAX_LANES void setPart(Segment<L>& segment) {
    const Float begin = whole_.walk().start(), end = whole_.walk().end();
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
  SegmentCubics<L, View> cell_;  // of whole cells
  WholeVoxelSegments<L, View> whole_;
  Mask live_;
  Float from_{-1.0f}, to_{1.0f}, way_{2.0f};  // the segments, as parts of the cells from -1 to 1
};

}  // namespace scolopax::kernel
