// SPDX-License-Identifier: Apache-2.0
// Cuts a ray into segments of one step, skips those in empty macrocells, and finds the curve positions of the
// channels at the segments' ends. Quadrature works on these segments.
#pragma once
#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/classifiers.h"

namespace scolopax::kernel {

/// One segment per ray.
template <class L>
struct Segment {
  using Mask = typename L::Mask;
  using Word = typename L::Word;
  typename L::Float start, end;  ///< world units along the ray
  std::uint32_t channels;        ///< bit n: channel n may have extinction for some ray; the others have none
  Mask live;                     ///< rays that have not ended
  bool apart;                    ///< rays may differ in their channels, which `met` gives
  Word met;                      ///< bit n: channel n may have extinction, for each ray

  SCOLOPAX_LANES typename L::Float length() const { return end - start; }
  /// Rays for which channel n, one of `channels`, may have extinction.
  SCOLOPAX_LANES Mask of(int n) const {
    if (L::kLanes == 1 || !apart) return live;
    return live & hasBit(met, n);
  }
  /// Rays for which more than one channel may have extinction.
  SCOLOPAX_LANES Mask several() const {
    if (L::kLanes > 1 && apart) return without(live, (met & (met - Word(1u))) == Word(0u));
    return (channels & (channels - 1)) != 0 ? live : without(live, live);
  }
};

/// Those of `channels` that may have extinction in the cell. Bit n: visible channel n.
SCOLOPAX_HD inline std::uint32_t activeChannels(const SceneView& scene, std::size_t cell,
                                                std::uint32_t channels) {
  if (!(scene.majorants.total(cell) > 0.0f)) return 0;
  std::uint32_t active = 0;
  for (int n = 0; n < scene.channelCount; ++n)
    if ((channels >> n & 1) && scene.majorants.bound(cell, n) > 0.0f) active |= 1u << n;
  return active;
}

/// Finds the segments of one ray, front to back, by walking from macrocell to macrocell. Segment k ends at
/// inside.enter + (k + offset) * step, with offset in (0, 1], but at inside.exit at the latest.
template <class View>
class CellSegments {
 public:
  /// `channels`: bit n is visible channel n.
  SCOLOPAX_HD CellSegments(SegmentEnds<One, View>& ends, const View& scene, const Ray& ray,
                           const Interval& inside, std::uint32_t channels, float offset, float step,
                           SampleCost* cost)
      : ends_(ends),
        scene_(scene),
        ray_(ray),
        inside_(inside),
        channels_(channels & inside.channels),
        offset_(offset),
        step_(step),
        cost_(cost),
        cells_(ray, inside, scene.majorants) {
    enterCell();
  }

  /// Advances to the next segment that may have extinction. If there is none, returns false and an empty
  /// segment. A device compiler inlines all of this wherever it is called, so a kernel should contain only
  /// one call per kind of ray.
  SCOLOPAX_HD bool next(Segment<One>& segment) {
    if (scene_.isCancelled() || !find()) {
      segment = {inside_.exit, inside_.exit, 0, false, false, 0};
      return false;
    }
    if (found_ != last_ + 1) known_ = 0;
    last_ = found_;
    segment = {end(found_ - 1), end(found_), has_, true, false, 0};
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(has_ >> n & 1)) continue;
      if (known_ >> n & 1)
        withClassifier(scene_, n, [&](auto classifier) { classifier.passOn(n, ends_); });
      else
        sample(n, segment.start, ends_.from);
      sample(n, segment.end, ends_.to);
    }
    known_ = has_;
    return true;
  }
  /// Ends the ray unless `wants` is true. Returns whether there may be more segments.
  SCOLOPAX_HD bool keep(bool wants) { return wants; }

 private:
  SCOLOPAX_HD float end(int segment) const {
    if (segment < 0) return inside_.enter;
    return minimum(inside_.enter + (float(segment) + offset_) * step_, inside_.exit);
  }

  SCOLOPAX_HD void sample(int n, float t, SegmentEnd<One, View>& end) {
    const ChannelView& channel = scene_.channels[n];
    const glm::vec3 point = ray_.origin + t * ray_.direction;
    const float stored = sampleStored<One>(channel.field, scene_.dims, point);
    withClassifier(scene_, n, [&](auto classifier) {
      classifier.template sample<One>(channel, scene_.dims, point, stored, n, end);
      cost_->fetches += channel.field.cost() + classifier.fetches(channel.field, scene_.dims);
    });
  }

  SCOLOPAX_HD void enterCell() {
    ++cost_->cellSteps;
    active_ = activeChannels(scene_, cells_.index(), channels_);
    if (waiting_ != 0) waiting_ |= active_;
    fresh_ = true;
  }

  /// Skips segments that end before the cell.
  SCOLOPAX_HD void skipToCell() {
    const float place = (cells_.enter() - inside_.enter) / step_ - offset_ + 1.0f;
    int guess = int(clamp(place, 0.0f, 1e9f));
    if (guess > 0 && cells_.enter() < end(guess - 1)) --guess;  // rounding gave the next segment
    if (guess > following_) following_ = guess;
    fresh_ = false;
  }

  /// Finds the next segment and all of its channels; false at the end of the ray.
  SCOLOPAX_HD bool find() {
    for (;;) {
      if (waiting_ != 0) {
        if (!(end(found_) > cells_.exit())) {
          has_ = waiting_;
          waiting_ = 0;
          return true;
        }
      } else if (active_ != 0) {
        if (fresh_) skipToCell();
        if (end(following_ - 1) < cells_.exit()) {
          if (++taken_ > kMaxSegments) {
            cost_->truncated = 1;
            return false;
          }
          found_ = following_++;
          has_ = active_;
          if (!(end(found_) > cells_.exit())) return true;
          waiting_ = active_;
        }
      }
      if (!cells_.advance() || scene_.isCancelled()) return false;
      enterCell();
    }
  }

  SegmentEnds<One, View>& ends_;
  const View& scene_;
  const Ray& ray_;
  Interval inside_;
  std::uint32_t channels_;
  float offset_, step_;
  SampleCost* cost_;
  CellWalk cells_;
  std::uint32_t active_;       // channels that may have extinction in the cell
  bool fresh_ = true;          // no segment of the cell has been taken
  int following_ = 0;          // first segment that no cell has taken
  int found_ = 0, taken_ = 0;  // segment found last, and number of segments found
  std::uint32_t has_ = 0;      // its channels
  std::uint32_t waiting_ = 0;  // channels of found_ if it extends beyond the cells visited so far, else 0
  int last_ = -2;              // segment sampled last
  std::uint32_t known_ = 0;    // channels that were sampled at its end
};

}  // namespace scolopax::kernel
