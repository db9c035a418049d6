// SPDX-License-Identifier: Apache-2.0
#include "server/pass_cost.h"

#include <gtest/gtest.h>

#include <random>

namespace scolopax::server {
namespace {

/// The true cost: small pictures cost more per pixel.
double truth(std::uint64_t pixels) { return 5e-4 + 1e-7 * double(pixels); }

TEST(PassCost, KnowsNothingBeforeTheFirstPass) {
  PassCost cost;
  EXPECT_FALSE(cost.known());
  EXPECT_EQ(cost.seconds(1000), 0);
}

TEST(PassCost, TakesOnePassToCostByThePixel) {
  PassCost cost;
  cost.add(1000, 0.004);
  EXPECT_TRUE(cost.known());
  EXPECT_NEAR(cost.seconds(1000), 0.004, 1e-12);
  EXPECT_NEAR(cost.seconds(4000), 0.016, 1e-12);
}

TEST(PassCost, TellsTheFixedPartFromThatOfThePixelsByTwoSizes) {
  PassCost cost;
  for (const std::uint64_t pixels : {20'000, 50'000}) cost.add(pixels, truth(pixels));
  EXPECT_NEAR(cost.fixedSeconds(), 5e-4, 1e-9);
  EXPECT_NEAR(cost.secondsPerPixel(), 1e-7, 1e-12);
  EXPECT_NEAR(cost.seconds(700'000), truth(700'000), 1e-6);
  // The fixed part is kept while all passes have one size, even if their cost drifts.
  for (const double drift : {1.0, 1.2})
    for (int i = 0; i < 10; ++i) cost.add(50'000, drift * truth(50'000));
  EXPECT_NEAR(cost.fixedSeconds(), 5e-4, 1e-9);
  EXPECT_NEAR(cost.seconds(50'000), 1.2 * truth(50'000), 1e-9);
}

TEST(PassCost, HasNoNegativePart) {
  PassCost dearer, cheaper;
  dearer.add(1000, 1e-5);  // more than proportional
  dearer.add(100'000, 0.1);
  EXPECT_GE(dearer.fixedSeconds(), 0);
  cheaper.add(1000, 0.1);  // the larger pass was faster
  cheaper.add(100'000, 0.01);
  for (const std::uint64_t pixels : {0, 1, 1000, 1'000'000}) {
    EXPECT_GE(dearer.seconds(pixels), 0);
    EXPECT_GE(cheaper.seconds(pixels), 0);
  }
  EXPECT_GE(dearer.secondsPerPixel(), 0);
  EXPECT_GE(cheaper.secondsPerPixel(), 0);
  PassCost none;
  none.add(1000, 0);
  none.add(0, 0);
  EXPECT_EQ(none.seconds(1000), 0);
}

TEST(PassCost, IsHardlyMovedByOneDisturbedPass) {
  PassCost cost;
  for (const std::uint64_t pixels : {20'000, 50'000, 50'000, 120'000, 120'000})
    cost.add(pixels, truth(pixels));
  cost.add(120'000, 8 * truth(120'000));
  EXPECT_NEAR(cost.seconds(120'000) / truth(120'000), 1, 0.1);
}

TEST(PassCost, FindsThatAllSizesCostTheSame) {
  PassCost cost;
  for (int i = 0; i < 7; ++i) cost.add(3000, 0.02 + truth(3000));
  cost.add(5000, 0.02 + truth(5000));  // one pass of another size is enough
  EXPECT_NEAR(cost.fixedSeconds(), 0.0205, 1e-9);
  EXPECT_NEAR(cost.seconds(50'000), 0.02 + truth(50'000), 1e-8);
}

TEST(PassCost, KnowsHowLargeRecentPicturesWereAndWhetherTheyTellTheFixedPart) {
  PassCost cost;
  EXPECT_EQ(cost.largestPixels(), 0);
  cost.add(50'000, 0.01);
  EXPECT_FALSE(cost.oneSize());
  for (int i = 0; i < 7; ++i) cost.add(20'000, 0.01);
  EXPECT_EQ(cost.largestPixels(), 50'000);
  EXPECT_FALSE(cost.oneSize());
  cost.add(20'000, 0.01);
  EXPECT_EQ(cost.largestPixels(), 20'000);
  EXPECT_TRUE(cost.oneSize());
}

TEST(PassCost, StaysWithinAThirdUnderNoiseAndSingleDisturbances) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> factor(0.8, 1.25);
  PassCost cost;
  int wrong = 0;
  for (int i = 0; i < 400; ++i) {
    const std::uint64_t pixels = 20'000 + random() % 100'000;
    cost.add(pixels, truth(pixels) * factor(random) * (i % 9 == 8 ? 4 : 1));
    const double ratio = cost.seconds(80'000) / truth(80'000);
    if (i > 8 && !(ratio > 0.75 && ratio < 1.33)) ++wrong;
  }
  EXPECT_LE(wrong, 20);  // of 391
}

TEST(PassCost, FollowsASceneThatCostsTenTimesAsMuchOrAsLittleWithinTwoPasses) {
  for (const double change : {10.0, 0.1}) {
    PassCost cost;
    for (int i = 0; i < 12; ++i) cost.add(50'000 + 10'000 * unsigned(i % 3), truth(60'000));
    cost.add(60'000, change * truth(60'000));
    cost.add(60'000, change * truth(60'000));
    EXPECT_NEAR(cost.seconds(60'000) / (change * truth(60'000)), 1, 1e-6) << change;
    EXPECT_NEAR(cost.seconds(90'000) / (change * truth(90'000)), 1, 0.1) << change;
  }
}

TEST(PassCost, TakesAPassThatIsLateToBeHalfDone) {
  PassCost cost;
  for (const std::uint64_t pixels : {20'000, 50'000}) cost.add(pixels, truth(pixels));
  cost.addUnfinished(50'000, 0.5 * truth(50'000));  // not late: no information
  EXPECT_NEAR(cost.seconds(50'000), truth(50'000), 1e-9);
  cost.addUnfinished(50'000, 0.075);
  EXPECT_NEAR(cost.seconds(50'000), 0.15, 1e-9);
  EXPECT_NEAR(cost.seconds(10'000), 0.03, 1e-9);
}

TEST(PassCost, ForgetsALatePassThatTheNextShowsToHaveBeenDisturbed) {
  PassCost cost;
  for (const std::uint64_t pixels : {20'000, 50'000}) cost.add(pixels, truth(pixels));
  cost.addUnfinished(50'000, 0.075);
  cost.add(10'000, truth(10'000));
  EXPECT_NEAR(cost.seconds(50'000) / truth(50'000), 1, 0.01);
}

TEST(PassCost, BelievesALatePassThatTheNextConfirms) {
  PassCost cost;
  for (int i = 0; i < 8; ++i) cost.add(50'000, truth(50'000));
  cost.addUnfinished(50'000, 10 * truth(50'000));
  cost.add(10'000, 20 * truth(10'000));
  EXPECT_GT(cost.seconds(50'000), 8 * truth(50'000));
}

TEST(PassCost, IsKnownByAPassThatWasGivenUp) {
  PassCost cost;
  cost.addUnfinished(1000, 0.1);
  EXPECT_TRUE(cost.known());
  EXPECT_NEAR(cost.seconds(500), 0.1, 1e-12);
}

}  // namespace
}  // namespace scolopax::server
