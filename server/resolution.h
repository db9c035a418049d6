// SPDX-License-Identifier: Apache-2.0
// Chooses the resolution at which a picture is ready in time, while edits arrive and on the way back to full
// resolution. Used by ProgressiveRender before each film. Knows how long passes took, but reads no clock.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "renderer/data/scene.h"
#include "server/pass_cost.h"

namespace scolopax::server {

/// The time limits of rendering.
struct RenderPolicy {
  std::chrono::microseconds frameTarget{25'000};      ///< for one pass while edits arrive
  std::chrono::microseconds minTarget{4'000};         ///< minimum of the target when many sessions are edited
  std::chrono::milliseconds interactiveInterval{33};  ///< between frames while edits arrive
  std::chrono::milliseconds stillInterval{500};       ///< between frames at rest, once there are many samples
  std::chrono::milliseconds tooLate{75};  ///< when an edit's first picture is restarted at a lower resolution
  int restFactor = 12;  ///< how many times longer a pass may take at each step to full resolution
  std::chrono::milliseconds slice{100};  ///< of a slow pass, until the next session's turn
  /// The same while an edit's first picture or a pick waits; also of a pick.
  std::chrono::milliseconds politeSlice{8};
  std::chrono::milliseconds shield{300};  ///< time for which a pass with a stale scene continues
};

/// The time for one session's pass while edits arrive at it and at `editedOthers` other sessions. All edited
/// sessions together have two frame targets per round, so pictures stay sharp while few sessions are edited.
std::chrono::microseconds targetOfPass(const RenderPolicy& policy, int editedOthers);

/// Maximum divisor of width and height.
inline constexpr double kMaxDivisor = 16;

/// The smallest of 1, 1.5, 2, 2.5, 3, 4, 6, 8, ... by which width and height must be divided so that a pass
/// meets the target. `current` is the divisor of the previous pass (0: none). It is kept until another one
/// fits clearly better, since a resolution that changes back and forth is worse than a picture that is
/// slightly late. After a previous pass, the result is never much larger than the largest picture whose cost
/// is known. If most of the target is spent on the fixed cost of a pass (for example because other processes
/// use the processors), smaller pictures gain nothing, and the target is raised.
double divisorForTarget(std::uint64_t pixels, const PassCost& cost, double targetSeconds, double current = 0);

/// The scene for a smaller picture of the same view. Its height is divided and rounded up; its width is the
/// smallest that shows the whole view. Samples go through pixel centres: the small picture is enlarged
/// smoothly, and a sample at the centre represents a pixel better than one anywhere in it.
Scene atDivisor(Scene scene, double divisor);

/// A session's choice of resolutions. `edited` distinguishes passes while edits arrive from passes at rest,
/// which are drawn differently and have different costs.
class ResolutionPolicy {
 public:
  explicit ResolutionPolicy(const RenderPolicy& policy) : policy_(policy) {}

  void passDone(bool edited, std::uint64_t pixels, double seconds) { cost_[edited].add(pixels, seconds); }
  /// To be called for a pass that was abandoned after `seconds`.
  void passGivenUp(bool edited, std::uint64_t pixels, double seconds) {
    cost_[edited].addUnfinished(pixels, seconds);
  }
  /// Discards all recorded costs. To be called for another data set.
  void forget();

  /// The divisor while edits arrive, here and at `editedOthers` other sessions; `pixels` is the size of the
  /// whole picture.
  double whileEdited(std::uint64_t pixels, int editedOthers);
  /// The divisor at rest. `shown` is the divisor of the reduced picture of this scene on the screen, if there
  /// is one; the result is clearly smaller, or 1.
  double atRest(std::uint64_t pixels, std::optional<double> shown) const;

 private:
  bool probes(const PassCost& cost);
  const PassCost& costOf(bool edited) const { return cost_[cost_[edited].known() ? edited : !edited]; }

  const RenderPolicy& policy_;
  PassCost cost_[2];
  static constexpr int kMinWait = 8,
                       kMaxWait = 64;  ///< pictures between two trials of a finer one

  double current_ = 0;  ///< the last divisor while edits arrived, without trials; 0 before
  int untilProbe_ = kMinWait, probeWait_ = kMinWait;
};

}  // namespace scolopax::server
