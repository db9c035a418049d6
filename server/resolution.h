// SPDX-License-Identifier: Apache-2.0
// How small a picture must be to be there in time: while edits arrive, and on the way back to the whole one.
// Asked by ProgressiveRender before each film; knows passes by what they took, and no clock.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "renderer/data/scene.h"
#include "server/pass_cost.h"

namespace scolopax::server {

/// When passes are cut, and what is done elsewhere.
struct RenderPolicy {
  std::chrono::microseconds frameTarget{25'000};      ///< for one pass while edits arrive
  std::chrono::microseconds leastTarget{4'000};       ///< that many edited sessions leave each other
  std::chrono::milliseconds interactiveInterval{33};  ///< between frames while edits arrive
  std::chrono::milliseconds stillInterval{500};       ///< between frames once samples are many
  std::chrono::milliseconds tooLate{75};              ///< the first picture of an edit is begun anew, coarser
  int restFactor = 12;                   ///< a pass may last so much longer at each step from small to whole
  std::chrono::milliseconds slice{100};  ///< of a slow pass, before other sessions have their turn
  std::chrono::milliseconds politeSlice{8};  ///< when one of them waits for an edit's first picture
  std::chrono::milliseconds shield{300};     ///< for so long a pass goes on when its scene is stale
};

/// The largest divisor of width and height.
inline constexpr double kMostDivisor = 16;

/// The smallest of 1, 1.5, 2, 2.5, 3, 4, 6, 8, ... by which width and height must be divided so that a pass
/// fits the target. `current`, that of the pass before (0: none), is kept until another fits clearly better:
/// a picture that changes its resolution to and fro is worse than one that is a little late. It is followed
/// by none that is much larger than the largest whose cost is known. Where what all sizes cost alike is most
/// of the target (the processors are others' too), small pictures bring nothing, and the target is more.
double divisorForTarget(std::uint64_t pixels, const PassCost& cost, double targetSeconds, double current = 0);

/// The scene for a smaller picture of the same view: its height divided and rounded up, its width the least
/// that shows as much as the whole picture. One sample at the centre of a pixel says more of a small picture,
/// which is smoothly enlarged, than one anywhere in the pixel.
Scene atDivisor(Scene scene, double divisor);

/// One session's choice of resolutions. `edited` tells passes while edits arrive from those at rest, which
/// are drawn otherwise and cost otherwise.
class ResolutionPolicy {
 public:
  explicit ResolutionPolicy(const RenderPolicy& policy) : policy_(policy) {}

  void passDone(bool edited, std::uint64_t pixels, double seconds) { cost_[edited].add(pixels, seconds); }
  /// A pass was given up after so long.
  void passGivenUp(bool edited, std::uint64_t pixels, double seconds) {
    cost_[edited].addUnfinished(pixels, seconds);
  }
  /// Another data set: what was learnt is of no use.
  void forget();

  /// While edits arrive, at `editedOthers` other sessions too; the whole picture has `pixels`.
  double whileEdited(std::uint64_t pixels, int editedOthers);
  /// At rest. `shown`: the divisor of the reduced picture of this scene that is on screen, which the next is
  /// to be better than.
  double atRest(std::uint64_t pixels, std::optional<double> shown) const;

 private:
  bool probes(const PassCost& cost);
  const PassCost& costOf(bool edited) const { return cost_[cost_[edited].known() ? edited : !edited]; }

  const RenderPolicy& policy_;
  PassCost cost_[2];
  static constexpr int kLeastWait = 8,
                       kMostWait = 64;  ///< pictures from one that is finer on trial to the next

  double current_ = 0;  ///< the last one while edits arrived, but on trial; 0 before
  int untilProbe_ = kLeastWait, probeWait_ = kLeastWait;
};

}  // namespace scolopax::server
