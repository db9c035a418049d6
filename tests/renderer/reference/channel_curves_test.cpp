// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/channel_curves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "renderer/core/error.h"

namespace scolopax::reference {
namespace {

ChannelAppearance over(double lo, double hi) {
  ChannelAppearance a;
  a.rangeLo = lo;
  a.rangeHi = hi;
  return a;
}

ChannelSample at(const ChannelCurves& curves, double scalar) {
  const double position = curves.position(scalar);
  return curves.sample(curves.pieceAt(position), position);
}

TEST(ChannelCurves, AreLinearBetweenKnotsAndConstantOutsideThem) {
  ChannelAppearance a;
  a.rangeLo = 100;
  a.rangeHi = 200;
  a.density = 10;
  a.opacity = {{0.25, 0.2}, {0.75, 0.6}};
  a.color = {{0.5, {1, 0, 0}}, {1, {0, 1, 0.5}}};
  const ChannelCurves curves(a);
  EXPECT_NEAR(at(curves, -1e9).extinction, 2, 1e-14);
  EXPECT_NEAR(at(curves, 110).extinction, 2, 1e-14);
  EXPECT_NEAR(at(curves, 150).extinction, 4, 1e-14);
  EXPECT_NEAR(at(curves, 190).extinction, 6, 1e-14);
  EXPECT_NEAR(at(curves, 1e9).extinction, 6, 1e-14);
  EXPECT_EQ(at(curves, 120).color, glm::dvec3(1, 0, 0));
  EXPECT_NEAR(at(curves, 175).color.x, 0.5, 1e-14);
  EXPECT_NEAR(at(curves, 175).color.z, 0.25, 1e-14);
}

TEST(ChannelCurves, OfTwoKnotsAtOnePositionTheLaterHoldsFromThereOn) {
  ChannelAppearance a;
  a.opacity = {{0, 0.1}, {0.5, 0.2}, {0.5, 0.8}, {1, 0.9}, {1, 0.3}};
  const ChannelCurves curves(a);
  EXPECT_NEAR(at(curves, 0.5 - 1e-12).extinction, 0.2, 1e-9);
  EXPECT_EQ(at(curves, 0.5).extinction, 0.8);
  EXPECT_NEAR(at(curves, 1 - 1e-12).extinction, 0.9, 1e-9);
  EXPECT_EQ(at(curves, 1).extinction, 0.3);
  EXPECT_EQ(at(curves, 7).extinction, 0.3);
}

TEST(ChannelCurves, AJumpAtZeroHoldsBelowTheRangeToo) {
  ChannelAppearance a;
  a.opacity = {{0, 0.25}, {0, 0.75}};
  EXPECT_EQ(at(ChannelCurves(a), -3).extinction, 0.75);
}

TEST(ChannelCurves, AReversedRangeReverses) {
  const ChannelAppearance a = over(10, 0);
  const ChannelCurves curves(a);
  EXPECT_EQ(at(curves, 10).extinction, 0);
  EXPECT_NEAR(at(curves, 2.5).extinction, 0.75, 1e-15);
  EXPECT_EQ(at(curves, -1).extinction, 1);
}

TEST(ChannelCurves, AnEmptyRangeIsAStepThatHoldsAtItsValue) {
  const ChannelCurves curves(over(5, 5));
  EXPECT_EQ(at(curves, std::nextafter(5.0, 0.0)).extinction, 0);
  EXPECT_EQ(at(curves, 5).extinction, 1);
  EXPECT_THAT(curves.breakpoints(), testing::ElementsAre(5));
  // A piece below the step stays below it, wherever rounding carries the scalar.
  EXPECT_EQ(curves.sample(curves.pieceAt(curves.position(4)), curves.position(5)).extinction, 0);
}

TEST(ChannelCurves, GammaActsOnThePositionBeforeBothCurves) {
  ChannelAppearance a;
  a.gamma = 2;
  a.rangeHi = 4;
  a.opacity = {{0, 0}, {0.25, 1}, {1, 0}};
  a.color = {{0, {0, 0, 0}}, {1, {1, 1, 1}}};
  const ChannelCurves curves(a);
  EXPECT_NEAR(at(curves, 2).extinction, 1, 1e-15);  // (2/4)^2 = 0.25
  EXPECT_NEAR(at(curves, 2).color.x, 0.25, 1e-15);
  EXPECT_THAT(curves.breakpoints(), testing::ElementsAre(0, 2, 4));
}

TEST(ChannelCurves, BreakpointsAreTheKnotsOfBothCurvesAndTheRange) {
  ChannelAppearance a = over(2, 4);
  a.opacity = {{0.25, 0}, {0.5, 1}};
  a.color = {{0.5, {0, 0, 0}}, {0.75, {1, 1, 1}}};
  EXPECT_THAT(ChannelCurves(a).breakpoints(), testing::ElementsAre(2, 2.5, 3, 3.5, 4));
}

TEST(ChannelCurves, KnowWhenThereIsNothingToSee) {
  ChannelAppearance a;
  EXPECT_TRUE(ChannelCurves(a).visible());
  a.opacity = {{0, 0}, {1, 0}};
  EXPECT_FALSE(ChannelCurves(a).visible());
  a.opacity = {{0, 0}, {0.5, 0}, {0.5, 1}, {0.5, 0}};  // no segment ends at the middle knot
  EXPECT_FALSE(ChannelCurves(a).visible());
  a.opacity = {{0, 1}};
  a.density = 0;
  EXPECT_FALSE(ChannelCurves(a).visible());
}

TEST(ChannelCurves, KnowBetweenWhichScalarsThereIsNothingToSee) {
  ChannelAppearance a = over(10, 20);
  a.opacity = {{0, 0}, {0.2, 0}, {0.4, 1}, {0.4, 0}, {0.8, 0}, {0.8, 1}};
  const ChannelCurves curves(a);
  EXPECT_FALSE(curves.visibleBetween(-5, 11.9));
  EXPECT_TRUE(curves.visibleBetween(-5, 12.1));
  EXPECT_FALSE(curves.visibleBetween(14, 17.9));
  EXPECT_TRUE(curves.visibleBetween(13.9, 17.9));
  EXPECT_TRUE(curves.visibleBetween(18, 18));
  a.rangeLo = 20, a.rangeHi = 10;  // reversed
  EXPECT_FALSE(ChannelCurves(a).visibleBetween(18.1, 30));
  EXPECT_TRUE(ChannelCurves(a).visibleBetween(17.9, 30));
}

TEST(ChannelCurves, RefuseWhatHasNoMeaning) {
  const auto make = [](auto change) {
    ChannelAppearance a;
    change(a);
    ChannelCurves{a};
  };
  EXPECT_NO_THROW(make([](ChannelAppearance&) {}));
  EXPECT_THROW(make([](ChannelAppearance& a) { a.opacity.clear(); }), Error);
  EXPECT_THROW(make([](ChannelAppearance& a) { a.color.clear(); }), Error);
  EXPECT_THROW(make([](ChannelAppearance& a) { a.opacity = {{0.5, 0}, {0.25, 1}}; }), Error);
  EXPECT_THROW(make([](ChannelAppearance& a) { a.gamma = 0; }), Error);
  EXPECT_THROW(make([](ChannelAppearance& a) { a.density = -1; }), Error);
  EXPECT_THROW(make([](ChannelAppearance& a) { a.rangeHi = std::numeric_limits<double>::quiet_NaN(); }),
               Error);
}

}  // namespace
}  // namespace scolopax::reference
