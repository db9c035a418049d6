// SPDX-License-Identifier: Apache-2.0
// The cubic B-spline of one cell: its polynomials against its values, and these against its definition.
#include "renderer/reference/spline_cell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <random>

namespace scolopax::reference {
namespace {

struct RandomSpline {
  std::array<double, 64> voxels;
  glm::dvec3 begin, end;
  explicit RandomSpline(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    for (double& v : voxels) v = 280 + 30 * unit(random);
    for (int axis = 0; axis < 3; ++axis) begin[axis] = unit(random), end[axis] = unit(random);
  }
  SplineCell cell() const { return SplineCell(voxels); }
  glm::dvec3 point(double u) const { return begin + u * (end - begin); }
};

/// The weights of four voxels: B-spline basis functions.
std::array<double, 4> weights(double t) {
  return {(1 - t) * (1 - t) * (1 - t) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
          (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
}

TEST(SplineCell, IsTheSumOfVoxelsTimesWeights) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const RandomSpline spline(random);
    const auto x = weights(spline.begin.x), y = weights(spline.begin.y), z = weights(spline.begin.z);
    double expected = 0;
    for (std::size_t i = 0; i < 64; ++i) expected += x[i % 4] * y[i / 4 % 4] * z[i / 16] * spline.voxels[i];
    EXPECT_NEAR(spline.cell()(spline.begin), expected, 1e-12 * expected);
  }
}

TEST(SplineCell, HasWeightsThatAddUpToOne) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 50; ++trial) {
    RandomSpline spline(random);
    double sum = 0;
    for (std::size_t i = 0; i < 64; ++i) {
      spline.voxels.fill(0);
      spline.voxels[i] = 1;
      const double weight = spline.cell()(spline.begin);
      EXPECT_GE(weight, 0);
      sum += weight;
    }
    EXPECT_NEAR(sum, 1, 1e-14);
  }
}

TEST(SplineCell, OfEqualVoxelsIsExactlyTheirValue) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    RandomSpline spline(random);
    spline.voxels.fill(spline.voxels[0]);
    EXPECT_EQ(spline.cell()(spline.begin), spline.voxels[0]);
    EXPECT_EQ(spline.cell().gradient(spline.begin), glm::dvec3(0));
    const Bernstein along = spline.cell().along(spline.begin, spline.end);
    for (double u = 0; u <= 1; u += 1.0 / 32) EXPECT_EQ(along(u), spline.voxels[0]);
    EXPECT_EQ(spline.cell().gradientAlong(spline.begin, spline.end).longest(), 0);
  }
}

TEST(SplineCell, OfVoxelsThatRiseEvenlyRisesEvenly) {
  std::mt19937 random(4);
  RandomSpline spline(random);
  const glm::dvec3 slope(0.5, -0.25, 2);  // exact in binary
  for (std::size_t i = 0; i < 64; ++i)
    spline.voxels[i] = slope.x * double(i % 4) + slope.y * double(i / 4 % 4) + slope.z * double(i / 16);
  for (double u = 0; u <= 1; u += 0.125) {
    const glm::dvec3 p = spline.point(u);
    EXPECT_NEAR(spline.cell()(p), glm::dot(slope, p + 1.0), 1e-14);
    EXPECT_EQ(spline.cell().gradient(p), slope);
    EXPECT_EQ(spline.cell().gradientAlong(spline.begin, spline.end)(u), slope);
  }
}

TEST(SplineCell, AtACornerCountsTheVoxelsAround) {
  std::mt19937 random(5);
  RandomSpline spline(random);
  // A huge voxel at the far side has weight 0 there, and must not wipe the others out.
  for (std::size_t i = 0; i < 64; ++i)
    if (i % 4 == 0) spline.voxels[i] = 1e30;
  double expected = 0;
  const double weight[] = {1, 4, 1};
  for (std::size_t i = 0; i < 64; ++i)
    if (i % 4 > 0 && i / 4 % 4 > 0 && i / 16 > 0)
      expected += weight[i % 4 - 1] * weight[i / 4 % 4 - 1] * weight[i / 16 - 1] * spline.voxels[i] / 216;
  EXPECT_NEAR(spline.cell()(glm::dvec3(1)), expected, 1e-11);
  EXPECT_NEAR(spline.cell().along({0.5, 0.5, 0.5}, glm::dvec3(1)).coefficients().back(), expected, 1e-11);
}

TEST(SplineCell, AlongALineIsItsValueAndGradientAtPoints) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 300; ++trial) {
    RandomSpline spline(random);
    if (trial % 5 == 0) spline.end[trial % 3] = spline.begin[trial % 3];
    if (trial % 7 == 0) spline.begin[trial % 3] = spline.end[trial % 3] = trial % 2;
    const SplineCell cell = spline.cell();
    const Bernstein along = cell.along(spline.begin, spline.end);
    const BernsteinVector gradient = cell.gradientAlong(spline.begin, spline.end);
    EXPECT_EQ(along.degree(), 9u);
    EXPECT_EQ(gradient.x.degree(), 8u);
    for (int k = 0; k < 10; ++k) {
      const double u = k == 0 ? 0 : k == 1 ? 1 : unit(random), expected = cell(spline.point(u));
      EXPECT_NEAR(along(u), expected, 1e-13 * expected);
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(gradient(u)[axis], cell.gradient(spline.point(u))[axis], 1e-12);
    }
    const auto [least, most] = std::minmax_element(spline.voxels.begin(), spline.voxels.end());
    EXPECT_GE(along.lower(), *least);
    EXPECT_LE(along.upper(), *most);
  }
}

TEST(SplineCell, GradientIsTheSlope) {
  std::mt19937 random(7);
  constexpr double h = 1e-5;
  for (int trial = 0; trial < 200; ++trial) {
    RandomSpline spline(random);
    const glm::dvec3 p = 0.1 + 0.8 * spline.begin, gradient = spline.cell().gradient(p);
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 step(0);
      step[axis] = h;
      // Third derivatives are below 300; rounding of values is 1e-13 / h.
      EXPECT_NEAR(gradient[axis], (spline.cell()(p + step) - spline.cell()(p - step)) / (2 * h), 1e-7);
    }
  }
}

}  // namespace
}  // namespace scolopax::reference
