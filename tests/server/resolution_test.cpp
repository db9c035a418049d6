// SPDX-License-Identifier: Apache-2.0
#include "server/resolution.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace scolopax::server {
namespace {

/// The cost model after passes with this cost per pixel.
PassCost costOf(double secondsPerPixel) {
  PassCost cost;
  cost.add(100'000, 100'000 * secondsPerPixel);
  return cost;
}

TEST(Resolution, ChoosesTheLargestThatFitsTheTarget) {
  EXPECT_EQ(divisorForTarget(1000, costOf(0), 0.04), 1);
  EXPECT_EQ(divisorForTarget(1000, costOf(1e-5), 0.04), 1);
  EXPECT_EQ(divisorForTarget(1000, costOf(8e-5), 0.04), 1.5);
  EXPECT_EQ(divisorForTarget(1000, costOf(1.5e-4), 0.04), 2);
  EXPECT_EQ(divisorForTarget(1000, costOf(2.4e-4), 0.04), 2.5);
  EXPECT_EQ(divisorForTarget(1000, costOf(3e-4), 0.04), 3);
  EXPECT_EQ(divisorForTarget(1000, costOf(1), 0.04), 16);
}

TEST(Resolution, StaysUntilAnotherFitsClearlyBetter) {
  const auto next = [](double current, double secondsAtOne) {
    return divisorForTarget(100'000, costOf(secondsAtOne / 100'000), 0.04, current);
  };
  EXPECT_EQ(next(2, 4 * 0.047), 2);     // a little late
  EXPECT_EQ(next(2, 4 * 0.049), 2.5);   // too late
  EXPECT_EQ(next(2, 2.25 * 0.033), 2);  // 1.5 would fit, but not clearly
  EXPECT_EQ(next(2, 2.25 * 0.031), 1.5);
}

TEST(Resolution, ShowsAsMuchInASmallPictureAsInTheWholeAndLessThanAPixelMore) {
  Scene scene;
  for (const auto& [width, height] :
       {std::pair{643, 561}, {512, 512}, {1, 1}, {7680, 1}, {3, 4096}, {1919, 1079}})
    for (const double divisor : {1.0, 1.5, 2.0, 3.0, 4.0, 16.0}) {
      scene.width = width, scene.height = height;
      const Scene small = atDivisor(scene, divisor);
      const double scale = double(height) / small.height;  // the vertical field of view is the same
      EXPECT_LE(scale, divisor);
      EXPECT_GE(small.width * scale, width - 1e-9) << width << "x" << height << " by " << divisor;
      EXPECT_LT((small.width - 1) * scale, width) << width << "x" << height << " by " << divisor;
      EXPECT_EQ(small.filter, divisor == 1 ? PixelFilter::box : PixelFilter::point);
    }
}

/// The divisors during a drag of a whole picture of `pixels`, whose passes take `seconds(...)`.
template <class Seconds>
std::vector<double> drag(ResolutionPolicy& policy, std::uint64_t pixels, int pictures, Seconds&& seconds) {
  std::vector<double> divisors;
  for (int i = 0; i < pictures; ++i) {
    divisors.push_back(policy.whileEdited(pixels, 0));
    const auto size = std::uint64_t(double(pixels) / divisors.back() / divisors.back());
    policy.passDone(true, size, seconds(size, i));
  }
  return divisors;
}

const RenderPolicy kDefaults;  // 25 ms
constexpr std::uint64_t kPixels = 944 * 770;
/// Seconds of a pass: 274 ns a ray at 61 x 50 and 99 ns at 944 x 770.
double measured(std::uint64_t pixels) { return 5.3e-4 + 0.98e-7 * double(pixels); }

TEST(Resolution, ComesFromASmallPictureToTheOneThatFits) {
  ResolutionPolicy policy(kDefaults);
  policy.passDone(true, 61 * 50, measured(61 * 50));
  const auto divisors = drag(policy, kPixels, 20, [](std::uint64_t pixels, int) { return measured(pixels); });
  for (std::size_t i = 6; i < divisors.size(); ++i) EXPECT_LE(divisors[i], 2) << i;
}

TEST(Resolution, IsNotSmallInVainWhereOthersUseTheProcessors) {
  // A pass of any size spends 18 or 30 ms waiting for a processor.
  for (const double waiting : {0.018, 0.030}) {
    ResolutionPolicy policy(kDefaults);
    drag(policy, kPixels, 40, [](std::uint64_t pixels, int) { return 0.1 + 1e-5 * double(pixels); });
    const auto divisors =
        drag(policy, kPixels, 100, [&](std::uint64_t pixels, int) { return waiting + measured(pixels); });
    for (std::size_t i = 50; i < divisors.size(); ++i) EXPECT_LE(divisors[i], 4) << waiting << " " << i;
  }
}

TEST(Resolution, TriesFinerPicturesSeldomWhereTheyDoNotFit) {
  ResolutionPolicy policy(kDefaults);
  const auto divisors =
      drag(policy, kPixels, 600, [](std::uint64_t pixels, int) { return measured(pixels); });
  EXPECT_LE(std::count_if(divisors.begin() + 12, divisors.end(), [](double d) { return d < 2; }), 14);
  EXPECT_EQ(std::count_if(divisors.begin() + 12, divisors.end(), [](double d) { return d > 2; }), 0);
}

TEST(Resolution, IsBackWithinTwoPicturesOfADisturbance) {
  ResolutionPolicy policy(kDefaults);
  drag(policy, kPixels, 12, [](std::uint64_t pixels, int) { return measured(pixels); });
  policy.passGivenUp(true, kPixels / 4, 0.075);
  const auto divisors = drag(policy, kPixels, 12, [](std::uint64_t pixels, int) { return measured(pixels); });
  EXPECT_GE(divisors[0], 4);  // the first picture after an edit must still come soon
  for (std::size_t i = 2; i < divisors.size(); ++i) EXPECT_LE(divisors[i], 2) << i;
}

TEST(Resolution, DoesNotAnswerSinglePassesThatWereDisturbed) {
  ResolutionPolicy policy(kDefaults);
  drag(policy, kPixels, 12, [](std::uint64_t pixels, int) { return measured(pixels); });
  const auto divisors = drag(policy, kPixels, 60, [](std::uint64_t pixels, int i) {
    return measured(pixels) * (i % 5 == 4 ? 3 : 1);
  });
  EXPECT_EQ(std::count_if(divisors.begin(), divisors.end(), [](double d) { return d > 2; }), 0);
  EXPECT_GE(std::count(divisors.begin(), divisors.end(), 2.0), 55);
}

TEST(Resolution, FollowsTheSceneWhenItCostsTenTimesAsMuchAndBack) {
  ResolutionPolicy policy(kDefaults);
  const auto divisors = drag(policy, kPixels, 40, [](std::uint64_t pixels, int i) {
    return measured(pixels) * (i >= 10 && i < 20 ? 10 : 1);
  });
  for (int i = 12; i < 20; ++i) EXPECT_GE(divisors[std::size_t(i)], 6) << i;
  for (int i = 27; i < 40; ++i) EXPECT_LE(divisors[std::size_t(i)], 2) << i;
}

TEST(Resolution, BeginsWithASmallPictureAndWithAWholeOneWhereNobodyEdits) {
  ResolutionPolicy policy(kDefaults);
  EXPECT_EQ(policy.atRest(kPixels, std::nullopt), 1);
  EXPECT_EQ(policy.whileEdited(kPixels, 0), 4);
  policy.passDone(false, kPixels, 0.39);  // another kind of pass serves as a first guess
  EXPECT_EQ(policy.whileEdited(kPixels, 0), 4);
  policy.passDone(false, kPixels, 0.02);
  policy.passDone(false, kPixels, 0.02);
  EXPECT_LT(policy.whileEdited(kPixels, 0), 4);
  policy.forget();
  EXPECT_EQ(policy.whileEdited(kPixels, 0), 4);
}

TEST(Resolution, AtRestBeginsWithASmallerPictureWhileOnlyTheCostOfEditsIsKnown) {
  ResolutionPolicy policy(kDefaults);
  policy.passDone(true, 10'000, 0.01);
  policy.passDone(true, 20'000, 0.02);  // 0.2 s for the whole picture of 200000, if it cost the same at rest
  const double first = policy.atRest(200'000, 6);
  EXPECT_EQ(first, 3);  // within 0.025 s
  policy.passDone(false, 22'000, 0.2);
  EXPECT_EQ(policy.atRest(200'000, first), 1);  // 1.8 s
}

TEST(Resolution, GetsFinerWithEveryStepAtRest) {
  ResolutionPolicy policy(kDefaults);
  policy.passDone(false, 1000, 1000 * 1e-4);  // 12 s for the whole picture of 120000
  const double first = policy.atRest(120'000, 16);
  EXPECT_EQ(first, 8);  // within 0.3 s
  const double second = policy.atRest(120'000, first);
  EXPECT_EQ(second, 2);  // within 3.6 s
  EXPECT_EQ(policy.atRest(120'000, second), 1);
}

}  // namespace
}  // namespace scolopax::server
