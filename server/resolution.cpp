// SPDX-License-Identifier: Apache-2.0
#include "server/resolution.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace scolopax::server {
namespace {

constexpr double kDivisors[] = {1, 1.5, 2, 2.5, 3, 4, 6, 8, 12, kMaxDivisor};
/// The first divisor while edits arrive, when no cost is known: a small pass is fast and gives a measurement.
constexpr double kProbeDivisor = 4;
/// Largest ratio of the pixels of a picture to those of the next coarser one, plus a margin.
constexpr double kLargestStep = 2.3;
/// Smallest ratio of the widths of two pictures at rest of which the second is worth rendering.
constexpr double kSmallestStep = 1.5;
/// The target is at least this many times the fixed cost.
constexpr double kOverFixed = 1.6;
constexpr double kFiner = 0.8, kKept = 1.2;  ///< shares of the target at which the divisor changes

double finerThan(double divisor) {
  return *(std::lower_bound(std::begin(kDivisors), std::end(kDivisors), divisor) - 1);
}

double secondsOf(std::chrono::microseconds time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

std::chrono::microseconds targetOfPass(const RenderPolicy& policy, int editedOthers) {
  return std::max(2 * policy.frameTarget / std::max(2, 1 + editedOthers), policy.minTarget);
}

double divisorForTarget(std::uint64_t pixels, const PassCost& cost, double targetSeconds, double current) {
  targetSeconds = std::max(targetSeconds, kOverFixed * cost.fixedSeconds());
  const double most = kLargestStep * cost.largestPixels();
  for (const double divisor : kDivisors) {
    if (current > 0 && most > 0 && double(pixels) / (divisor * divisor) > most) continue;
    const double share = current == 0 || divisor > current ? 1 : divisor < current ? kFiner : kKept;
    if (cost.seconds(std::uint64_t(std::ceil(double(pixels) / (divisor * divisor)))) <= targetSeconds * share)
      return divisor;
  }
  return *std::rbegin(kDivisors);
}

Scene atDivisor(Scene scene, double divisor) {
  if (divisor == 1) return scene;
  const int height = int(std::ceil(scene.height / divisor));
  scene.width = int((std::int64_t(scene.width) * height + scene.height - 1) / scene.height);
  scene.height = height;
  scene.filter = PixelFilter::point;
  return scene;
}

void ResolutionPolicy::forget() {
  cost_[false] = cost_[true] = {};
  current_ = 0;
  untilProbe_ = probeWait_ = kMinWait;
}

/// Passes of a single size do not show which part of their cost is fixed, but an occasional finer picture
/// does. These trials become rarer while the finer pictures do not fit.
bool ResolutionPolicy::probes(const PassCost& cost) {
  if (current_ <= 1 || !cost.oneSize() || --untilProbe_ > 0) return false;
  untilProbe_ = probeWait_ = std::min(2 * probeWait_, kMaxWait);
  return true;
}

double ResolutionPolicy::whileEdited(std::uint64_t pixels, int editedOthers) {
  const PassCost& cost = costOf(true);
  if (!cost.known()) return kProbeDivisor;
  const double target = secondsOf(targetOfPass(policy_, editedOthers));
  const double divisor = divisorForTarget(pixels, cost, target, current_);
  if (divisor < current_) untilProbe_ = probeWait_ = kMinWait;
  if (divisor == current_ && probes(cost)) return finerThan(current_);
  return current_ = divisor;
}

double ResolutionPolicy::atRest(std::uint64_t pixels, std::optional<double> shown) const {
  const PassCost& cost = costOf(false);
  if (!cost.known()) return 1;
  double seconds = secondsOf(policy_.frameTarget), divisor = 1;
  // While edits arrive, `auto` takes a coarse step: at rest a pass may take ten times as long.
  if (!cost_[false].known()) seconds /= policy_.restFactor;
  do divisor = divisorForTarget(pixels, cost, seconds *= policy_.restFactor);
  while (divisor > 1 && shown && divisor * kSmallestStep > *shown);
  return divisor;
}

}  // namespace scolopax::server
