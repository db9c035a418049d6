// SPDX-License-Identifier: Apache-2.0
#include "server/commands/bench_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

namespace scolopax::bench {
namespace {

const std::optional<Image> kTruth = Image{1, 1, {glm::vec4(0)}};

/// Two pictures of one pixel with this bias and independent noise of this size.
Point point(Method method, std::uint32_t samples, double seconds, double bias, double noise,
            double step = 0) {
  Point made(Setting{method, samples, step, 4, 1});
  made.choice = {method == Method::automatic ? Method::raymarch : method, step, {}};
  // At right angles to each other and to the bias.
  for (const glm::dvec4& direction : {glm::dvec4(1, -1, 1, -1), glm::dvec4(1, 1, -1, -1)}) {
    made.seconds.push_back(seconds);
    made.setSceneSeconds.push_back(0);
    made.squaredErrors.push_back(bias * bias + noise * noise);
    made.sum.resize(1, glm::dvec4(0));
    made.sum[0] += bias + noise * direction;
  }
  return made;
}

std::optional<Reached> reached(double rmse, const std::vector<Point>& points) {
  std::vector<const Point*> pointers;
  for (const Point& one : points) pointers.push_back(&one);
  return reach(rmse, pointers, kTruth);
}

TEST(Reach, OfATrackerIsByTheLawOfItsNoiseFromTheMostSamples) {
  const auto found =
      reached(1e-3, {point(Method::syncDda, 1, 9, 0, 9), point(Method::syncDda, 16, 2, 0, 0.01)});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->samples, 1600, 1e-6);
  EXPECT_NEAR(found->seconds, 200, 1e-6);
}

TEST(Reach, OfTheMarcherIsByTheFastestStepWhoseBiasIsSmallEnough) {
  const std::vector<Point> points{point(Method::raymarch, 1, 1, 2e-3, 0, 4),
                                  point(Method::raymarch, 1, 2, 5e-4, 0, 2),
                                  point(Method::raymarch, 1, 4, 1e-4, 0, 1)};
  EXPECT_EQ(reached(1e-3, points)->step, 2);
  EXPECT_EQ(reached(4e-4, points)->step, 1);
  EXPECT_FALSE(reached(1e-5, points));
}

TEST(Reach, OfAStepIsExtrapolatedAboveItsBiasAndNotFar) {
  // Error^2 = 1e-8 + 9.9e-7 x 4 / samples.
  const std::vector<Point> points{point(Method::raymarch, 4, 4, 1e-4, std::sqrt(9.9e-7), 1)};
  EXPECT_NEAR(reached(std::sqrt(1e-8 + 9.9e-8), points)->samples, 40, 1);
  EXPECT_FALSE(reached(1.5e-4, points));  // 317 samples, more than 16 times those measured
  EXPECT_FALSE(reached(0.9e-4, points));
}

TEST(Reach, OfAutoIsBetweenItsPointsAndNotExtrapolated) {
  const std::vector<Point> points{point(Method::automatic, 1, 1, 1e-2, 0),
                                  point(Method::automatic, 4, 4, 1e-3, 0),
                                  point(Method::automatic, 16, 64, 1e-5, 0)};
  EXPECT_NEAR(reached(1e-3, points)->seconds, 4, 1e-9);
  EXPECT_NEAR(reached(1e-4, points)->seconds, 16, 1e-9);  // halfway in logarithms
  EXPECT_NEAR(reached(1e-4, points)->samples, 8, 1e-9);
  EXPECT_NEAR(reached(2e-2, points)->seconds, 1, 1e-9);
  EXPECT_FALSE(reached(9e-6, points));
}

TEST(Reach, OfAutoThatTakesATrackerIsByTheTrackersLaw) {
  Point tracked = point(Method::automatic, 16, 2, 0, 0.01);
  tracked.choice.method = Method::superposed;
  EXPECT_NEAR(reached(1e-3, {tracked})->seconds, 200, 1e-6);
}

TEST(Reach, IncludesTheTimeBeforeTheFirstSampleOnce) {
  for (const Method method : {Method::automatic, Method::raymarch, Method::superposed}) {
    std::vector<Point> points{point(method, 1, 1, 0, 1e-2, 1), point(method, 4, 4, 0, 5e-3, 1)};
    const double without = reached(6e-3, points)->seconds;
    for (Point& one : points) one.setSceneSeconds = {0.3, 0.5};
    EXPECT_NEAR(reached(6e-3, points)->seconds, without + 0.4, 1e-9) << nameOf(method);
  }
}

TEST(Median, OfAnEvenNumberIsBetweenTheTwoInTheMiddle) {
  EXPECT_EQ(median({3}), 3);
  EXPECT_EQ(median({9, 1, 3}), 3);
  EXPECT_EQ(median({9, 1, 3, 5}), 4);
}

TEST(Report, HasTheTimesToAllErrorsAndWhatAutoChose) {
  Point own = point(Method::automatic, 4, 4, 0, 1e-6);
  own.choice = {Method::raymarch, 2, {{1, 3}}};
  own.setSceneSeconds = {0.5, 0.5};
  own.estimates = {2e-6, 1e-6};
  const auto made = report({own}, kTruth, 1);
  for (const char* target : {"0.01", "0.001", "0.0001", "1e-05"})
    EXPECT_EQ(made["timeToError"][0]["secondsToRmse" + std::string(target)], 4.5) << target;
  const auto& row = made["points"][0];
  EXPECT_EQ(row["choice"]["method"], "raymarch");
  EXPECT_EQ(row["choice"]["step"], 2);
  EXPECT_EQ(row["choice"]["corrections"][0]["passes"], 3);
  EXPECT_EQ(row["setSceneSeconds"], 0.5);
  EXPECT_NEAR(row["estimateToError"].get<double>(), 1.5, 1e-9);
}

}  // namespace
}  // namespace scolopax::bench
