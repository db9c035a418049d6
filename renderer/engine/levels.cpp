// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/levels.h"

#include <algorithm>
#include <cmath>

namespace scolopax {
namespace {

/// Pictures of few samples are seen while a scene is edited, where corrections would only delay them.
constexpr double kFirstSamples = 4;
constexpr double kMostSamples = 1u << 31;

/// Corrections that a level should have once it has begun.
double wanted(const Level& level, std::uint32_t samples) {
  return std::max(level.first, std::floor(level.perSample * samples));
}

}  // namespace

std::vector<Level> scheduleLevels(double variance, std::span<const LevelEstimate> estimates) {
  std::vector<Level> levels;
  double left = 0;  // bias without this level and all after it
  for (const LevelEstimate& e : estimates) left += e.most;
  double from = kFirstSamples;
  for (const LevelEstimate& e : estimates) {
    const double rest = left - e.most;
    // What the level removes from the squared error, apart from its own noise, which is variance / N after N
    // corrections. Removing it is worth most with this many at once.
    const double removed = std::max(left * left - rest * rest, 1e-30);
    const double first = std::ceil(std::max(1.0, 2 * e.variance / removed));
    const double gain = std::max(removed - e.variance / first, 1e-30) / (first * e.cost);
    // Another sample, after n of them, removes variance / n^2.
    from = std::min(std::max(from, std::ceil(std::sqrt(variance / gain))), kMostSamples);
    double perSample = e.variance > 0 ? 1 : 0;
    if (variance > 0) perSample = std::min(1.0, std::sqrt(e.variance / (variance * e.cost)));
    levels.push_back({e, std::uint32_t(from), first, perSample});
    left = rest;
  }
  return levels;
}

bool isEnough(const Level& level, std::uint32_t corrections, std::uint32_t samples) {
  const double best = std::floor(level.perSample * samples);
  return corrections >= level.first || (best >= 1 && corrections >= best);
}

std::optional<std::size_t> dueLevel(std::span<const Level> levels, std::uint32_t samples, const Film& film) {
  std::optional<std::size_t> due;
  double least = 1;
  for (std::size_t l = 0; l < levels.size() && l <= film.levels(); ++l) {
    if (samples < levels[l].from) break;
    const double have = l < film.levels() ? film.corrections(l) : 0;
    const double part = have / wanted(levels[l], samples);
    if (part >= least) continue;
    least = part;
    due = l;
  }
  return due;
}

double biasLeft(std::span<const Level> levels, const Film& film) {
  if (levels.empty()) return 0;
  std::size_t begun = 0;
  while (begun < film.levels() && film.isIncluded(begun)) ++begun;
  // At the end of the ladder, every halving reduces the corrections to a quarter.
  double left = levels.back().estimate.size / 3;
  for (std::size_t l = begun; l < levels.size(); ++l) left += levels[l].estimate.size;
  // The film's own corrections say more than the estimates do.
  if (begun == 0 || film.corrections(begun - 1) < 2) return left;
  const double estimated = levels[begun - 1].estimate.size;
  return estimated > 0 ? left * (film.correctionSize(begun - 1) / estimated) : left;
}

}  // namespace scolopax
