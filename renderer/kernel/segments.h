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

/// Consecutive segments: number k goes from t[k] to t[k + 1], world units along the ray.
struct SegmentRun {
  int count = 0;
  float t[kRunSegments + 1];
  std::uint32_t active[kRunSegments];  ///< bit n: channel n may have extinction; the others have none
  std::uint32_t sampled = 0;           ///< channels that are active in some segment
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

/// Finds the runs of a ray, front to back. Segment k ends at inside.enter + (k + offset) * step, with offset
/// in (0, 1], or at inside.exit.
template <class Visit>
class SegmentWalk {
 public:
  /// `visit(run)` is called for every run, until it returns false.
  SCOLOPAX_HD SegmentWalk(const SceneView& scene, const Ray& ray, Interval inside, float offset, float step,
                          SampleCost* cost, Visit& visit)
      : scene_(scene), ray_(ray), inside_(inside), offset_(offset), step_(step), cost_(cost), visit_(visit) {}

  /// All channels, or `only` that one when it is not negative.
  SCOLOPAX_HD void follow(int only) {
    CellWalk walk(ray_, inside_, scene_.majorants);
    int next = 0;               // first segment that no cell has taken
    std::uint32_t waiting = 0;  // not 0: segment next - 1 reaches beyond the cells so far; their channels
    int taken = 0;
    do {
      ++cost_->cellSteps;
      const std::uint32_t active = activeChannels(scene_, walk.index(), only);
      if (waiting != 0) {
        waiting |= active;
        if (end(next - 1) > walk.exit()) continue;
        if (!take(next - 1, waiting)) return;
        waiting = 0;
      }
      if (active == 0) continue;
      // The segment in which the cell begins.
      const float place = (walk.enter() - inside_.enter) / step_ - offset_ + 1.0f;
      int guess = int(clamp(place, 0.0f, 1e9f));
      if (guess > 0 && walk.enter() < end(guess - 1)) --guess;  // rounding had come to the next
      if (guess > next) next = guess;
      while (end(next - 1) < walk.exit()) {
        if (++taken > kMaxSegments) {
          cost_->truncated = 1;
          return;
        }
        const int segment = next++;
        if (end(segment) > walk.exit())
          waiting = active;
        else if (!take(segment, active))
          return;
      }
    } while (walk.advance());
    if (run_.count > 0) finish();
  }

 private:
  SCOLOPAX_HD float end(int segment) const {
    if (segment < 0) return inside_.enter;
    return minimum(inside_.enter + (float(segment) + offset_) * step_, inside_.exit);
  }

  /// Adds a segment to the run; false when the visitor wants no more.
  SCOLOPAX_HD bool take(int segment, std::uint32_t active) {
    if (run_.count > 0 && segment != last_ + 1 && !finish()) return false;
    if (segment != last_ + 1) known_ = 0;
    last_ = segment;
    if (run_.count == 0) {
      run_.t[0] = end(segment - 1);
      run_.sampled = 0;
    }
    run_.active[run_.count] = active;
    run_.sampled |= active;
    run_.t[++run_.count] = end(segment);
    // Where the run begins anew its first point is sampled with the others.
    const int most = known_ != 0 || kRunSegments == 1 ? kRunSegments : kRunSegments - 1;
    return run_.count < most || finish();
  }

  SCOLOPAX_HD bool finish() {
    sample();
    const bool more = visit_(run_);
    for (int n = 0; n < scene_.channelCount; ++n)
      if (run_.sampled >> n & 1) run_.position[n][0] = run_.position[n][run_.count];
    known_ = run_.sampled;
    run_.count = 0;
    return more;
  }

  SCOLOPAX_HD glm::vec3 pointAt(int k) const { return ray_.origin + run_.t[k] * ray_.direction; }

  SCOLOPAX_HD void sample() {
#if !defined(__CUDA_ARCH__)
    if (scene_.sampleBatch && run_.count >= kFewPoints) return sampleTogether();
#endif
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(run_.sampled >> n & 1)) continue;
      for (int k = known_ >> n & 1 ? 1 : 0; k <= run_.count; ++k) samplePoint(n, k);
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
      const glm::vec3 p = pointAt(first + i < run_.count ? first + i : run_.count);
      points.x[i] = p.x, points.y[i] = p.y, points.z[i] = p.z;
    }
    float stored[kMaxVisibleChannels][kBatchPoints];
    scene_.sampleBatch(scene_, run_.sampled, points, stored);
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(run_.sampled >> n & 1)) continue;
      if (first == 1 && !(known_ >> n & 1)) samplePoint(n, 0);
      for (int k = first; k <= run_.count; ++k)
        run_.position[n][k] = stretchPosition(scene_.channels[n], stored[n][k - first]);
      cost_->fetches += std::uint32_t(run_.count + 1 - first);
    }
  }
#endif

  const SceneView& scene_;
  const Ray& ray_;
  Interval inside_;
  float offset_, step_;
  SampleCost* cost_;
  Visit& visit_;
  SegmentRun run_;
  int last_ = -2;            // segment taken last
  std::uint32_t known_ = 0;  // channels whose position at the run's start is known from the run before
};

}  // namespace scolopax::kernel
