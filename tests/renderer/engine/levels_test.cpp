// SPDX-License-Identifier: Apache-2.0
// The schedule of multi-level quadrature: how many corrections each level has, and when.
#include "renderer/engine/levels.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scolopax {
namespace {

/// Levels of second order: half the step, twice the cost, a quarter of the size.
std::vector<LevelEstimate> secondOrder(double size, double variance) {
  std::vector<LevelEstimate> levels;
  for (int l = 0; l < 5; ++l) {
    const double fine = std::pow(2.0, l + 1);
    levels.push_back({{1 / fine, false},
                      {2 / fine, false},
                      1.5 * fine,
                      size * std::pow(0.25, l),
                      size * std::pow(0.25, l),
                      variance * std::pow(0.0625, l)});
  }
  return levels;
}

/// A film of one pixel in which the first levels have these numbers of corrections, all of the same size.
void fill(Film& film, const std::vector<std::uint32_t>& corrections, float size = 0) {
  film.reset(1, 1);
  film.pass()[0] = glm::vec4(0);
  film.add();
  for (std::size_t l = 0; l < corrections.size(); ++l) {
    film.addLevel();
    for (std::uint32_t i = 0; i < corrections[l]; ++i) {
      film.fine()[0] = glm::vec4(size);
      film.coarse()[0] = glm::vec4(0);
      film.addCorrection(l);
    }
    if (corrections[l] > 0) film.include(l);
    size /= 3;
  }
}

TEST(Schedule, SpreadsPassesByVarianceAndCost) {
  const auto levels = scheduleLevels(1e-2, secondOrder(1e-3, 1e-4));
  ASSERT_EQ(levels.size(), 5u);
  // sqrt(V_l / (V_0 C_l)), from minimising the sum of V_l / N_l at a given sum of N_l C_l.
  EXPECT_NEAR(levels[0].perSample, std::sqrt(1e-4 / (1e-2 * 3)), 1e-12);
  EXPECT_NEAR(levels[1].perSample, std::sqrt(6.25e-6 / (1e-2 * 6)), 1e-12);
}

TEST(Schedule, BeginsALevelWhenItIsWorthMoreThanSamples) {
  // Without noise of its own, level 1 removes (1e-3 + ...)^2 - (2.5e-4 + ...)^2 for the cost of 3 samples.
  const auto levels = scheduleLevels(1e-2, secondOrder(1e-3, 0));
  double whole = 0;
  for (int l = 0; l < 5; ++l) whole += 1e-3 * std::pow(0.25, l);
  const double removed = whole * whole - (whole - 1e-3) * (whole - 1e-3);
  EXPECT_EQ(levels[0].first, 1);
  EXPECT_EQ(levels[0].from, std::uint32_t(std::ceil(std::sqrt(1e-2 * 3 / removed))));
  for (std::size_t l = 1; l < levels.size(); ++l) EXPECT_GT(levels[l].from, levels[l - 1].from);
  // With noise larger than what it removes, one correction would make the picture worse.
  const auto noisy = scheduleLevels(1e-2, secondOrder(1e-3, 1e-3));
  EXPECT_GT(noisy[0].first, 1000);
  EXPECT_GT(noisy[0].from, levels[0].from);
  EXPECT_FALSE(isEnough(noisy[0], 1, 4));
  EXPECT_TRUE(isEnough(noisy[0], std::uint32_t(noisy[0].first), 4));
  // If there are so many samples that their noise is smaller than the level's share of it, fewer corrections
  // are enough.
  EXPECT_TRUE(isEnough(noisy[0], 100, std::uint32_t(100 / noisy[0].perSample) + 1));
}

TEST(Schedule, LeavesTheFirstSamplesAlone) {
  for (const Level& level : scheduleLevels(0, secondOrder(1, 0))) EXPECT_GE(level.from, 4u);
  EXPECT_EQ(scheduleLevels(1, {}).size(), 0u);
}

TEST(Schedule, OfWhatHasNoSizeBeginsLate) {
  for (const Level& level : scheduleLevels(1e-2, secondOrder(0, 0))) EXPECT_GT(level.from, 1u << 20);
}

TEST(DueLevel, IsTheOneThatLacksMost) {
  const auto levels = scheduleLevels(1e-2, secondOrder(1e-2, 1e-4));
  Film film;
  fill(film, {});
  EXPECT_FALSE(dueLevel(levels, 3, film));
  const std::uint32_t late = 1'000'000;
  EXPECT_EQ(dueLevel(levels, late, film), 0u);
  // A level follows only when the one before it has begun.
  fill(film, {1});
  EXPECT_EQ(dueLevel(levels, late, film), 1u);
  fill(film, {1, 1, 1, 1, 1});
  EXPECT_EQ(dueLevel(levels, late, film), 0u);
  // With enough samples, every level has the number of corrections that it should have.
  std::vector<std::uint32_t> all;
  for (const Level& level : levels)
    all.push_back(std::uint32_t(std::max(level.first, std::floor(level.perSample * 1000))));
  fill(film, all);
  EXPECT_FALSE(dueLevel(levels, 1000, film));
  EXPECT_EQ(dueLevel(levels, 2000, film), 0u);
}

TEST(BiasLeft, IsThatOfLevelsWithoutCorrections) {
  const auto levels = scheduleLevels(1e-2, secondOrder(1e-3, 1e-4));
  Film film;
  fill(film, {});
  // 1e-3 (1 + 1/4 + 1/16 + ...)
  EXPECT_NEAR(biasLeft(levels, film), 1e-3 * 4 / 3, 1e-9);
  fill(film, {1});
  EXPECT_NEAR(biasLeft(levels, film), 1e-3 / 3, 1e-9);
  fill(film, {1, 1, 1, 1, 1});
  EXPECT_NEAR(biasLeft(levels, film), 1e-3 / 256 / 3, 1e-9);
  EXPECT_EQ(biasLeft({}, film), 0);
}

TEST(BiasLeft, TakesTheFilmsOwnCorrectionsForBetterThanTheEstimates) {
  const auto levels = scheduleLevels(1e-2, secondOrder(1e-3, 1e-4));
  Film film;
  fill(film, {2}, 4e-3f);  // four times the estimate
  EXPECT_NEAR(biasLeft(levels, film), 4 * 1e-3 / 3, 1e-8);
}

}  // namespace
}  // namespace scolopax
