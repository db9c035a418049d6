// SPDX-License-Identifier: Apache-2.0
#include "server/resolution.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace scolopax::server {
namespace {

constexpr double kDivisors[] = {1, 1.5, 2, 2.5, 3, 4, 6, 8, 12, kMostDivisor};
/// Before anything is known, while edits arrive: a small pass tells.
constexpr double kProbeDivisor = 4;
constexpr double kFiner = 0.8, kKept = 1.2;  ///< shares of the target at which the divisor changes

double secondsOf(std::chrono::microseconds time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

double divisorForTarget(std::uint64_t pixels, const PassCost& cost, double targetSeconds, double current) {
  for (const double divisor : kDivisors) {
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
}

double ResolutionPolicy::whileEdited(std::uint64_t pixels, int editedOthers) {
  const PassCost& cost = costOf(true);
  if (!cost.known()) return kProbeDivisor;
  // All that are edited together have two targets a round, so that the picture stays sharp when they are few.
  const auto target = std::max(2 * policy_.frameTarget / std::max(2, 1 + editedOthers), policy_.leastTarget);
  return current_ = divisorForTarget(pixels, cost, secondsOf(target), current_);
}

double ResolutionPolicy::atRest(std::uint64_t pixels, std::optional<double> shown) const {
  const PassCost& cost = costOf(false);
  if (!cost.known()) return 1;
  double seconds = secondsOf(policy_.frameTarget), divisor = 1;
  do divisor = divisorForTarget(pixels, cost, seconds *= policy_.restFactor);
  while (divisor > 1 && shown && divisor >= *shown);
  return divisor;
}

}  // namespace scolopax::server
