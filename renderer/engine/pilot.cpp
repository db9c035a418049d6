// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/pilot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/engine/thumbnails.h"

namespace scolopax {
namespace {

constexpr std::size_t kPilotSamples = 4;
/// The finest resolution of which thumbnails are rendered; finer ones are extrapolated. Coarser thumbnails
/// alone would mislead: steps that all skip the same detail give similar pictures.
constexpr int kFinestThumbnail = kEqualSteps + 2;
/// Bias that a film's samples should not exceed if that is affordable, because a picture is shown without
/// corrections while its scene is edited: half a level of an 8-bit picture.
constexpr double kUnseenBias = 2e-3;
/// Factor by which low-discrepancy sampling reduces the variance of quadrature's samples: 2 to 10 where it
/// was measured. That of corrections is reduced less.
constexpr double kEvenSamplesGain = 4;
/// Cost of a tracker's fetch in fetches of quadrature, which takes many rays at a time.
constexpr double kTrackerFetch = 4;
/// Error at which the work of quadrature and of a tracker are compared.
constexpr double kUsualError = 3e-4;
/// Bias that may be left after the last level, where a tracker would be rendered instead.
constexpr double kBiasLeft = 1e-3;

/// Thumbnails at the first resolutions of the ladder.
class Ladder {
 public:
  /// Begins at resolution number `first`, and leaves out those with steps below `leastStep`; there are always
  /// whole voxel cells.
  Ladder(Thumbnails& thumbnails, int first, double leastStep) : leastStep_(leastStep), next_(first) {
    while (complete_ && next_ <= kFinestThumbnail) render(thumbnails);
    // In dense matter, halves of voxel cells may differ from whole ones, and finer parts from those as much.
    if (complete_ && isRough()) render(thumbnails);
  }

  /// Whether the thumbnails have not taken too much work. The rest requires it.
  bool complete() const { return complete_; }
  int size() const { return int(pictures_.size()); }
  const Resolution& resolution(int i) const { return at(i).resolution; }
  double variance(int i) const { return scolopax::variance(at(i)); }
  double cost(int i) const { return std::max(1.0, at(i).fetches); }
  /// RMS difference between the expected pictures of two resolutions.
  double difference(int coarse, int fine) const {
    return std::sqrt(std::max(0.0, squaredDifference(at(fine), at(coarse)).value));
  }
  /// The correction between two resolutions. Costs are fetches per ray.
  LevelEstimate correction(int coarse, int fine) const {
    return {at(fine).resolution,      at(coarse).resolution, cost(coarse) + cost(fine),
            difference(coarse, fine), upper(coarse, fine),   varianceOfDifference(at(fine), at(coarse))};
  }
  /// Corrections between the resolutions from the last thumbnail on, extrapolated.
  std::vector<LevelEstimate> rest() const {
    std::vector<LevelEstimate> levels;
    if (size() < 3) return levels;
    LevelEstimate last = correction(size() - 2, size() - 1);
    // Of second order, unless the last two differences show that they fall more slowly.
    double sizes = 0.25, variances = 0.25;
    if (isRough()) {
      const LevelEstimate before = correction(size() - 3, size() - 2);
      sizes = std::clamp(last.size / before.size, sizes, 0.9);
      variances = std::clamp(last.variance / before.variance, variances, 0.9);
    }
    for (int i = next_; i < kResolutions && resolutionAt(i).step >= leastStep_; ++i) {
      const double cost = 2 * last.cost;
      last = {resolutionAt(i),   last.fine,         cost,
              last.size * sizes, last.most * sizes, last.variance * variances};
      levels.push_back(last);
    }
    return levels;
  }

 private:
  const Pictures& at(int i) const { return pictures_[std::size_t(i)]; }
  void render(Thumbnails& thumbnails) {
    const Resolution resolution = resolutionAt(next_++);
    if (resolution.step < leastStep_) return;
    std::optional<Pictures> pictures = thumbnails.render(resolution, kPilotSamples);
    complete_ = pictures.has_value();
    if (pictures) pictures_.push_back(std::move(*pictures));
  }
  /// Whether the last two pictures certainly differ by more than is usually wanted.
  bool isRough() const {
    if (size() < 3) return false;
    const Estimate squared = squaredDifference(at(size() - 1), at(size() - 2));
    return squared.value > 3 * squared.deviation && std::sqrt(squared.value) > kUsualError;
  }
  /// The difference if it is a standard deviation above the estimate.
  double upper(int coarse, int fine) const {
    const Estimate squared = squaredDifference(at(fine), at(coarse));
    return std::sqrt(std::max(0.0, squared.value) + squared.deviation);
  }

  std::vector<Pictures> pictures_;
  double leastStep_;
  int next_;  // resolution after those of the thumbnails
  bool complete_ = true;
};

/// The resolutions through which a film is corrected, the base first, and the work that they need: the square
/// root of the fetches per ray for a variance of 1.
struct Path {
  std::vector<int> resolutions;
  double work = std::numeric_limits<double>::infinity();
};

/// The path with the least work from any resolution to the last of the ladder. Work adds up: the least sum of
/// V_l / N_l at a given sum of N_l C_l is the square of the sum of sqrt(V_l C_l).
Path cheapestPath(const Ladder& ladder) {
  const int last = ladder.size() - 1;
  const auto mayBegin = [&](int i) { return i == last || ladder.difference(i, last) <= kUnseenBias; };
  std::vector<Path> to(std::size_t(ladder.size()));
  for (int i = 0; i <= last; ++i) {
    Path& path = to[std::size_t(i)];
    if (mayBegin(i)) path = {{i}, std::sqrt(ladder.variance(i) * ladder.cost(i))};
    for (int j = 0; j < i; ++j) {
      const Path& before = to[std::size_t(j)];
      if (before.resolutions.empty()) continue;
      const LevelEstimate correction = ladder.correction(j, i);
      const double work = before.work + std::sqrt(correction.variance * correction.cost);
      if (work >= path.work) continue;
      path = before;
      path.resolutions.push_back(i);
      path.work = work;
    }
  }
  return to.back();
}

}  // namespace

AutomaticChoice chooseAutomatically(Launcher& launcher, const RenderPlan& plan, const std::stop_token& stop) {
  // Shadow rays, if there are any, cost the most.
  const Method quadrature = plan.scene().shadows ? Method::hybrid : Method::raymarch;
  Thumbnails thumbnails(launcher, plan, quadrature, true, kMostChoiceWork, stop);
  // Equal steps between the faces of nearest voxels are whole cells, or parts of them.
  const Ladder ladder(thumbnails, plan.view().nearest ? kEqualSteps : 0, finestEstimatedStep(plan.grid()));
  if (!ladder.complete()) return {Method::superposed, resolutionOf(Scene()), {}, thumbnails.rays()};
  const Path path = cheapestPath(ladder);

  const int base = path.resolutions.front();
  std::vector<LevelEstimate> levels;
  for (std::size_t k = 1; k < path.resolutions.size(); ++k)
    levels.push_back(ladder.correction(path.resolutions[k - 1], path.resolutions[k]));
  for (const LevelEstimate& level : ladder.rest()) levels.push_back(level);
  double work = std::sqrt(ladder.variance(base) * ladder.cost(base)), left = 0;
  const double baseWork = work;
  for (const LevelEstimate& level : levels) left += level.size;
  for (LevelEstimate& level : levels) {
    if (left > kUsualError) work += std::sqrt(level.variance * level.cost);
    left -= level.size;
    level.cost /= ladder.cost(base);
  }
  // The film's samples are spread evenly, those of the thumbnails are not.
  const double gain = plan.scene().sampling == Sampling::lowDiscrepancy ? kEvenSamplesGain : 1;
  const double rest = levels.empty() ? 0 : levels.back().size;
  AutomaticChoice choice{quadrature, ladder.resolution(base),
                         scheduleLevels(ladder.variance(base) / gain, levels), thumbnails.rays()};
  if (rest <= kBiasLeft && work <= 2 * baseWork) return choice;
  Thumbnails tracked(launcher, plan, Method::superposed, true, kMostChoiceWork, stop);
  const std::optional<Pictures> tracker = tracked.render({}, kPilotSamples);
  const auto isCheaper = [&] {
    return tracker && std::sqrt(variance(*tracker) * tracker->fetches * kTrackerFetch) < work;
  };
  if (rest > kBiasLeft || isCheaper()) choice = {Method::superposed, resolutionOf(Scene()), {}, 0};
  choice.rays = thumbnails.rays() + tracked.rays();
  return choice;
}

}  // namespace scolopax
