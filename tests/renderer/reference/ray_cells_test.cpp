// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/ray_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <random>

namespace scolopax::reference {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

std::vector<double> coordinatesOfCuts(const RayCells& ray, int axis) {
  std::vector<double> result;
  for (const double t : ray.cuts) result.push_back(ray.origin[axis] + t * ray.direction[axis]);
  return result;
}

TEST(RayCells, BeginAtTheFacesAndCutAtThePlanesThroughVoxelCentres) {
  const RayCells ray = cutAtCells({-20, 0.3, 0.7}, {2, 0, 0}, {4, 2, 2});
  EXPECT_THAT(coordinatesOfCuts(ray, 0), ElementsAre(-0.5, 0, 1, 2, 3, 3.5));
  const RayCells back = cutAtCells({20, 0.3, 0.7}, {-2, 0, 0}, {4, 2, 2});
  EXPECT_THAT(coordinatesOfCuts(back, 0), ElementsAre(3.5, 3, 2, 1, 0, -0.5));
}

TEST(RayCells, AreCutAtTheFacesOfVoxelsWhereAsked) {
  const RayCells ray = cutAtCells({-20, 0.3, 0.7}, {2, 0, 0}, {4, 1, 2}, 100, CutAt::voxelCentresAndFaces);
  EXPECT_THAT(coordinatesOfCuts(ray, 0), ElementsAre(-0.5, 0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5));
  const RayCells oblique = cutAtCells({-3, -2, -5}, {1, 0.7, 1.3}, {5, 4, 6}, 100),
                 more = cutAtCells({-3, -2, -5}, {1, 0.7, 1.3}, {5, 4, 6}, 100, CutAt::voxelCentresAndFaces);
  EXPECT_TRUE(std::is_sorted(more.cuts.begin(), more.cuts.end()));
  EXPECT_TRUE(std::includes(more.cuts.begin(), more.cuts.end(), oblique.cuts.begin(), oblique.cuts.end()));
  EXPECT_GT(more.cuts.size(), oblique.cuts.size() + 5);
}

TEST(RayCells, BeginAtTheOriginInsideTheBox) {
  const RayCells ray = cutAtCells({1.25, 0.3, 0.7}, {1, 0, 0}, {4, 2, 2});
  EXPECT_THAT(coordinatesOfCuts(ray, 0), ElementsAre(1.25, 2, 3, 3.5));
}

TEST(RayCells, AreInOrderOnAnObliqueRay) {
  const RayCells ray = cutAtCells({-3, -2, -5}, {1, 0.7, 1.3}, {5, 4, 6});
  ASSERT_GT(ray.cuts.size(), 8u);
  EXPECT_TRUE(std::is_sorted(ray.cuts.begin(), ray.cuts.end()));
}

TEST(RayCells, AreNoneWhereTheRayMissesOrEndsBeforeTheBox) {
  EXPECT_TRUE(cutAtCells({-20, 9, 0}, {1, 0, 0}, {4, 2, 2}).cuts.empty());
  EXPECT_TRUE(cutAtCells({-20, 0, 0}, {-1, 0, 0}, {4, 2, 2}).cuts.empty());
  EXPECT_TRUE(cutAtCells({-20, -20, 0}, {1, 2, 0}, {4, 2, 2}).cuts.empty());
}

// A ray along a face of a rotated box has rounding errors in its origin and direction.
TEST(RayCells, CountAFaceAsInsideWhateverRoundingBroughtTheRayThere) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 300; ++trial) {
    glm::dmat3 m;
    for (int axis = 0; axis < 3; ++axis) m[axis] = {normal(random), normal(random), normal(random)};
    if (std::abs(glm::determinant(m)) < 0.3) continue;
    const glm::dvec3 zero(100 * normal(random), 100 * normal(random), 100 * normal(random));
    const glm::dvec3 world = m * glm::dvec3(-30, trial % 2 ? -0.5 : 4.5, trial % 3 ? 1.3 : 2.5) + zero;
    const RayCells ray = cutAtCells(glm::inverse(m) * (world - zero), glm::inverse(m) * m[0], {4, 5, 3});
    ASSERT_FALSE(ray.cuts.empty()) << trial;
    EXPECT_NEAR(ray.cuts.back() - ray.cuts.front(), 4, 1e-9) << trial;
  }
}

TEST(RayCells, AreOnTheRightSideOfTheToleranceOfAFace) {
  EXPECT_FALSE(cutAtCells({-20, -0.5 - 1e-10, 0}, {1, 0, 0}, {4, 2, 2}).cuts.empty());
  EXPECT_TRUE(cutAtCells({-20, -0.5 - 1e-8, 0}, {1, 0, 0}, {4, 2, 2}).cuts.empty());
}

}  // namespace
}  // namespace scolopax::reference
