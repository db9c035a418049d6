// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/cell_scalar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace scolopax::reference {
namespace {

struct RandomCell {
  std::array<double, 8> corners;
  glm::dvec3 begin, end;
  explicit RandomCell(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    for (double& c : corners) c = 280 + 30 * unit(random);
    for (int axis = 0; axis < 3; ++axis) begin[axis] = unit(random), end[axis] = unit(random);
  }
  double trilinear(const glm::dvec3& p) const {
    double sum = 0;
    for (int i = 0; i < 8; ++i)
      sum += corners[std::size_t(i)] * (i & 1 ? p.x : 1 - p.x) * (i & 2 ? p.y : 1 - p.y) *
             (i & 4 ? p.z : 1 - p.z);
    return sum;
  }
  CellScalar scalar() const { return {corners, begin, end}; }
};

TEST(CellScalar, IsTheTrilinearInterpolationAlongTheLine) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const RandomCell cell(random);
    const CellScalar scalar = cell.scalar();
    for (double u = 0; u <= 1; u += 0.125)
      EXPECT_NEAR(scalar(u), cell.trilinear(cell.begin + u * (cell.end - cell.begin)), 1e-11);
  }
}

TEST(CellScalar, StaysWithinItsBoundsAndTheseWithinTheCorners) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const RandomCell cell(random);
    const CellScalar scalar = cell.scalar();
    for (double u = 0; u <= 1; u += 1.0 / 64) {
      EXPECT_GE(scalar(u), scalar.lower());
      EXPECT_LE(scalar(u), scalar.upper());
    }
    EXPECT_GE(scalar.lower(), *std::min_element(cell.corners.begin(), cell.corners.end()));
    EXPECT_LE(scalar.upper(), *std::max_element(cell.corners.begin(), cell.corners.end()));
  }
}

TEST(CellScalar, OfAConstantCellIsExactlyThatConstant) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 200; ++trial) {
    RandomCell cell(random);
    cell.corners.fill(cell.corners[0]);
    const CellScalar scalar = cell.scalar();
    for (double u = 0; u <= 1; u += 1.0 / 32) EXPECT_EQ(scalar(u), cell.corners[0]);
  }
}

TEST(CellScalar, FindsEveryCrossingThatAFineScanSees) {
  std::mt19937 random(3);
  int threeTimes = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    RandomCell cell(random);
    // Corner to corner with alternating values: cubics that cross three times occur.
    for (int axis = 0; axis < 3; ++axis) cell.begin[axis] = 0, cell.end[axis] = 1;
    if (trial % 2) {
      cell.corners[1] = cell.corners[2] = cell.corners[4] = 340;
      cell.corners[3] = cell.corners[5] = cell.corners[6] = 250;
    }
    const CellScalar scalar = cell.scalar();
    const double value = 295;
    std::vector<double> crossings;
    scalar.appendCrossings(value, crossings);
    EXPECT_TRUE(std::is_sorted(crossings.begin(), crossings.end()));
    threeTimes += crossings.size() == 3;
    for (const double u : crossings) EXPECT_NEAR(scalar(u), value, 1e-10);
    constexpr int kSteps = 1000;
    for (int i = 0; i < kSteps; ++i) {
      const double a = double(i) / kSteps, b = double(i + 1) / kSteps;
      if ((scalar(a) < value) == (scalar(b) < value)) continue;
      EXPECT_TRUE(std::any_of(crossings.begin(), crossings.end(),
                              [&](double u) { return u >= a - 1e-12 && u <= b + 1e-12; }));
    }
  }
  EXPECT_GT(threeTimes, 100);
}

TEST(CellScalar, HasNoCrossingWithValuesOutsideOrAtItsBounds) {
  const CellScalar scalar({0, 1, 0, 1, 0, 1, 0, 1}, {0, 0.5, 0.5}, {1, 0.5, 0.5});
  std::vector<double> crossings;
  for (const double value : {-1.0, 0.0, 1.0, 2.0}) scalar.appendCrossings(value, crossings);
  EXPECT_TRUE(crossings.empty());
  scalar.appendCrossings(0.3, crossings);
  ASSERT_EQ(crossings.size(), 1u);
  EXPECT_NEAR(crossings[0], 0.3, 1e-15);
}

}  // namespace
}  // namespace scolopax::reference
