// SPDX-License-Identifier: Apache-2.0
// A ray cut into segments of one step, without those in empty macrocells, and the channels' positions at
// their ends: what quadrature works on. Segments come in runs, so that a processor can sample several points
// at once.
#pragma once
#include "renderer/kernel/cell_walk.h"
#include "renderer/kernel/optical_curve.h"
#include "renderer/kernel/sample_volume.h"

namespace scolopax::kernel {

/// Most segments in a run; on a device, where a thread has little memory of its own, one.
#if defined(__CUDA_ARCH__)
inline constexpr int kRunSegments = 1;
#else
inline constexpr int kRunSegments = kBatchPoints;
#endif
/// Segments after which a ray gives up and counts as truncated.
inline constexpr int kMaxSegments = 1 << 20;

/// Consecutive segments: number k goes from t[k] to t[k + 1], world units along the ray. What variables index
/// is in here and nothing else: a device keeps such objects in memory, all of them.
struct SegmentRun {
  float t[kRunSegments + 1];
  std::uint32_t active[kRunSegments];  ///< bit n: channel n may have extinction; the others have none
  /// Of every sampled channel at every t[k]: where it lies on its curves (stretchPosition).
  float position[kMaxVisibleChannels][kRunSegments + 1];
};

/// Bit n: channel n may have extinction in the cell. `only` >= 0 leaves out all others.
SCOLOPAX_HD inline std::uint32_t activeChannels(const SceneView& scene, std::size_t cell, int only) {
  if (!(scene.majorants.total(cell) > 0.0f)) return 0;
  if (only >= 0) return scene.majorants.bound(cell, only) > 0.0f ? 1u << only : 0u;
  std::uint32_t active = 0;
  for (int n = 0; n < scene.channelCount; ++n)
    if (scene.majorants.bound(cell, n) > 0.0f) active |= 1u << n;
  return active;
}

/// Finds the segments of a ray, front to back. Segment k ends at inside.enter + (k + offset) * step, with
/// offset in (0, 1], or at inside.exit.
class SegmentWalk {
 public:
  /// Of all channels, or `only` that one when it is not negative.
  SCOLOPAX_HD SegmentWalk(SegmentRun& run, const SceneView& scene, const Ray& ray, Interval inside, int only,
                          float offset, float step, SampleCost* cost)
      : run_(run),
        scene_(scene),
        ray_(ray),
        inside_(inside),
        only_(only),
        offset_(offset),
        step_(step),
        cost_(cost),
        cells_(ray, inside, scene.majorants) {
    enterCell();
  }

  /// Goes on to the next segment that may have extinction; false when there is none: then the segment is one
  /// where no channel is active. A device's compiler
  /// inlines all of it wherever this is called: once in a kernel for every kind of ray.
  SCOLOPAX_HD bool next() { return ++k_ < count_ || nextRun(); }

  /// The segment is number k() of the run.
  SCOLOPAX_HD const SegmentRun& run() const { return run_; }
  SCOLOPAX_HD int k() const { return k_; }
  SCOLOPAX_HD float start() const { return run_.t[k_]; }
  SCOLOPAX_HD float length() const { return run_.t[k_ + 1] - run_.t[k_]; }

 private:
  SCOLOPAX_HD float end(int segment) const {
    if (segment < 0) return inside_.enter;
    return minimum(inside_.enter + (float(segment) + offset_) * step_, inside_.exit);
  }

  SCOLOPAX_HD void enterCell() {
    ++cost_->cellSteps;
    active_ = activeChannels(scene_, cells_.index(), only_);
    if (waiting_ != 0) waiting_ |= active_;
    fresh_ = true;
  }

  /// Leaves out segments that end before the cell.
  SCOLOPAX_HD void skipToCell() {
    const float place = (cells_.enter() - inside_.enter) / step_ - offset_ + 1.0f;
    int guess = int(clamp(place, 0.0f, 1e9f));
    if (guess > 0 && cells_.enter() < end(guess - 1)) --guess;  // rounding had come to the next
    if (guess > following_) following_ = guess;
    fresh_ = false;
  }

  /// Finds the next segment and all of its channels; false at the end of the ray.
  SCOLOPAX_HD bool find() {
    for (;;) {
      if (waiting_ != 0) {
        if (!(end(found_) > cells_.exit())) {
          channels_ = waiting_;
          waiting_ = 0;
          return true;
        }
      } else if (active_ != 0) {
        if (fresh_) skipToCell();
        if (end(following_ - 1) < cells_.exit()) {
          if (++taken_ > kMaxSegments) {
            if (count_ == 0) cost_->truncated = 1;  // else this looks ahead of what may be the last
            return false;
          }
          found_ = following_++;
          channels_ = active_;
          if (!(end(found_) > cells_.exit())) return true;
          waiting_ = active_;
        }
      }
      if (!cells_.advance()) return false;
      enterCell();
    }
  }

  SCOLOPAX_HD bool nextRun() {
    for (int n = 0; n < scene_.channelCount; ++n)
      if (sampled_ >> n & 1) run_.position[n][0] = run_.position[n][count_];
    known_ = sampled_;
    sampled_ = 0;
    count_ = k_ = 0;
    do {
      if (!kept_ && !find()) break;
      // A run has no gaps: what does not follow begins the next.
      kept_ = count_ > 0 && found_ != last_ + 1;
      if (kept_) break;
      if (found_ != last_ + 1) known_ = 0;
      last_ = found_;
      if (count_ == 0) run_.t[0] = end(found_ - 1);
      run_.active[count_] = channels_;
      sampled_ |= channels_;
      run_.t[++count_] = end(found_);
      // Where the run begins anew its first point is sampled with the others.
    } while (count_ < (known_ != 0 || kRunSegments == 1 ? kRunSegments : kRunSegments - 1));
    if (count_ == 0) {
      run_.active[0] = 0;
      run_.t[0] = run_.t[1] = inside_.exit;
      return false;
    }
    sample();
    return true;
  }

  SCOLOPAX_HD glm::vec3 pointAt(int k) const { return ray_.origin + run_.t[k] * ray_.direction; }

  SCOLOPAX_HD void sample() {
#if !defined(__CUDA_ARCH__)
    if (scene_.sampleBatch && count_ >= kFewPoints) return sampleTogether();
#endif
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(sampled_ >> n & 1)) continue;
      for (int k = known_ >> n & 1 ? 1 : 0; k <= count_; ++k) samplePoint(n, k);
    }
  }
  SCOLOPAX_HD void samplePoint(int n, int k) {
    const ChannelView& channel = scene_.channels[n];
    run_.position[n][k] = stretchPosition(channel, sampleStored(channel, scene_.dims, pointAt(k)));
    ++cost_->fetches;
  }

#if !defined(__CUDA_ARCH__)
  /// Below so many points one by one is faster.
  static constexpr int kFewPoints = 3;

  void sampleTogether() {
    const int first = known_ != 0 ? 1 : 0;  // a run that begins anew has room for its first point
    PointBatch points;
    for (int i = 0; i < kBatchPoints; ++i) {
      const glm::vec3 p = pointAt(first + i < count_ ? first + i : count_);
      points.x[i] = p.x, points.y[i] = p.y, points.z[i] = p.z;
    }
    float stored[kMaxVisibleChannels][kBatchPoints];
    scene_.sampleBatch(scene_, sampled_, points, stored);
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(sampled_ >> n & 1)) continue;
      if (first == 1 && !(known_ >> n & 1)) samplePoint(n, 0);
      for (int k = first; k <= count_; ++k)
        run_.position[n][k] = stretchPosition(scene_.channels[n], stored[n][k - first]);
      cost_->fetches += std::uint32_t(count_ + 1 - first);
    }
  }
#endif

  SegmentRun& run_;
  const SceneView& scene_;
  const Ray& ray_;
  Interval inside_;
  int only_;
  float offset_, step_;
  SampleCost* cost_;
  CellWalk cells_;
  std::uint32_t active_;       // channels of the cell
  bool fresh_ = true;          // nothing of the cell is taken
  int following_ = 0;          // first segment that no cell has taken
  int found_ = 0, taken_ = 0;  // segment found last, and how many were
  std::uint32_t channels_ = 0;
  std::uint32_t waiting_ = 0;  // not 0: found_ reaches beyond the cells so far; their channels
  bool kept_ = false;          // found_ is not in a run yet
  int count_ = 0, k_ = 0;      // segments of the run, and which of them it is
  std::uint32_t sampled_ = 0;  // channels that are active in some of them
  int last_ = -2;              // segment taken last
  std::uint32_t known_ = 0;    // channels whose position at the run's start is known from the run before
};

}  // namespace scolopax::kernel
