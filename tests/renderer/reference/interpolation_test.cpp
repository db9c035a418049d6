// SPDX-License-Identifier: Apache-2.0
// Scalars and gradients of cubic and nearest interpolation: values that can be computed by hand, borders,
// ties, and voxels that are not finite.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "renderer/reference/scalar_field.h"
#include "tests/renderer/reference/point_field.h"
#include "tests/renderer/reference/test_volumes.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {
namespace {

using namespace test;

/// A channel of its own.
struct Field {
  Volume volume;
  ScalarField scalar;
  Field(const glm::ivec3& dims, const VoxelFunction& voxels, Interpolation interpolation)
      : volume(makeVolume(gridOf(dims), {voxels})), scalar(volume.channels()[0], dims, interpolation) {}
  double operator()(double x, double y, double z) const { return scalar({x, y, z}); }
  glm::dvec3 gradient(double x, double y, double z) const { return scalar.gradient({x, y, z}); }
};

TEST(Interpolation, IsWhatItsDefinitionSays) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Interpolation interpolation : kInterpolations)
    for (const glm::ivec3 dims : {glm::ivec3(5, 4, 6), glm::ivec3(2, 3, 1), glm::ivec3(1)}) {
      const Field field(
          dims, [&](int, int, int) { return 100 * unit(random); }, interpolation);
      const PointField expected(field.volume.channels()[0], dims, interpolation);
      for (int i = 0; i < 300; ++i) {
        const glm::dvec3 p = glm::dvec3(unit(random), unit(random), unit(random)) * glm::dvec3(dims) - 0.5;
        EXPECT_NEAR(field.scalar(p), expected.scalar(p), 1e-12) << nameOf(interpolation);
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_NEAR(field.scalar.gradient(p)[axis], (*expected.gradient(p))[axis], 1e-12)
              << nameOf(interpolation);
      }
    }
}

TEST(Interpolation, OfAConstantIsExactlyThatConstant) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-0.5, 3.5);
  for (const Interpolation interpolation : kInterpolations) {
    const Field field(
        {4, 4, 4}, [](int, int, int) { return 0.1f; }, interpolation);
    for (int i = 0; i < 200; ++i) {
      const glm::dvec3 p(place(random), place(random), place(random));
      EXPECT_EQ(field.scalar(p), double(0.1f)) << nameOf(interpolation);
      EXPECT_EQ(field.scalar.gradient(p), glm::dvec3(0)) << nameOf(interpolation);
    }
  }
}

TEST(CubicInterpolation, ReproducesALinearFieldInsideTheBorder) {
  const Field field(
      {7, 6, 5}, [](int i, int j, int k) { return 2 * i - 0.5 * j + k; }, Interpolation::cubic);
  for (const glm::dvec3 p : {glm::dvec3(1, 1, 1), glm::dvec3(2.3, 3.9, 1.25), glm::dvec3(5, 4, 3)}) {
    EXPECT_NEAR(field.scalar(p), 2 * p.x - 0.5 * p.y + p.z, 1e-13);
    EXPECT_EQ(field.scalar.gradient(p), glm::dvec3(2, -0.5, 1));
  }
}

TEST(CubicInterpolation, SmoothsASingleVoxel) {
  const Field field(
      {7, 7, 7}, [](int i, int j, int k) { return i == 3 && j == 3 && k == 3; }, Interpolation::cubic);
  EXPECT_NEAR(field(3, 3, 3), 8.0 / 27, 1e-15);
  EXPECT_NEAR(field(4, 3, 3), 4.0 / 54, 1e-15);
  EXPECT_NEAR(field(3.5, 3, 3), 23.0 / 48 * 4 / 9, 1e-15);
  EXPECT_NEAR(field(1.5, 3, 3), 1.0 / 48 * 4 / 9, 1e-15);
  EXPECT_EQ(field(1, 3, 3), 0);
  EXPECT_EQ(field(5.2, 3, 3), 0);
  EXPECT_EQ(field.gradient(3, 3, 3), glm::dvec3(0));
  EXPECT_NEAR(field.gradient(4, 3, 3).x, -0.5 * 4 / 9, 1e-15);
}

TEST(CubicInterpolation, RepeatsTheVoxelsAtTheBorder) {
  const Field field(
      {4, 1, 1}, [](int i, int, int) { return i == 0   ? 6
                                              : i == 3 ? 12
                                                       : 0; }, Interpolation::cubic);
  EXPECT_NEAR(field(0, 0, 0), 5, 1e-14);  // (6 + 4 x 6 + 0) / 6
  EXPECT_NEAR(field(3, 0, 0), 10, 1e-14);
  for (const double x : {-0.5, -0.2}) {
    EXPECT_EQ(field(x, 0.3, -0.4), field(0, 0, 0));
    EXPECT_EQ(field.gradient(x, 0.3, -0.4), glm::dvec3(-3, 0, 0));  // also beyond the outer voxel centres
  }
  EXPECT_EQ(field(3.4, 0, 0), field(3, 0, 0));
  EXPECT_EQ(field.gradient(3.4, 0, 0), glm::dvec3(6, 0, 0));
}

TEST(CubicInterpolation, GradientIsTheSlope) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  const Field field(
      {5, 4, 6}, [&](int, int, int) { return unit(random); }, Interpolation::cubic);
  constexpr double h = 1e-5;
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 p = 0.01 + 0.98 * glm::dvec3(unit(random), unit(random), unit(random)) *
                                    glm::dvec3(field.scalar.dims() - 1);
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 step(0);
      step[axis] = h;
      // Across a plane of voxel centres the third derivative jumps by less than 10.
      EXPECT_NEAR(field.scalar.gradient(p)[axis], (field.scalar(p + step) - field.scalar(p - step)) / (2 * h),
                  1e-9);
    }
  }
}

TEST(CubicInterpolation, HasNoValueInCellsThatAVoxelWhichIsNotFiniteReaches) {
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
    const Field field(
        {9, 9, 3}, [&](int i, int j, int) { return i == 4 && j == 4 ? bad : 1; }, Interpolation::cubic);
    EXPECT_EQ(field(1.99, 4, 1), 1);
    EXPECT_TRUE(std::isnan(field(2, 4, 1)));  // cell [2, 3] reaches to voxel 4
    EXPECT_TRUE(std::isnan(field(5.99, 4, 1)));
    EXPECT_EQ(field(6, 4, 1), 1);
    EXPECT_EQ(field(4, 1.99, 1), 1);
    EXPECT_TRUE(std::isnan(field(2, 2, -0.5)));
    EXPECT_EQ(field.gradient(2, 4, 1), glm::dvec3(0));
  }
  // Beyond the outer voxel centres lies the outermost cell.
  const Field edge(
      {6, 1, 1}, [](int i, int, int) { return i == 2 ? kNaN : 1; }, Interpolation::cubic);
  EXPECT_TRUE(std::isnan(edge(-0.5, 0, 0)));
  EXPECT_EQ(edge(4.5, 0, 0), 1);
  const Field other(
      {6, 1, 1}, [](int i, int, int) { return i == 3 ? kNaN : 1; }, Interpolation::cubic);
  EXPECT_TRUE(std::isnan(other(5.5, 0, 0)));
  EXPECT_EQ(other(0.5, 0, 0), 1);
}

TEST(NearestInterpolation, TakesTheLaterOfTwoVoxelsAtTheSameDistance) {
  const Field field(
      {4, 3, 2}, [](int i, int j, int k) { return i + 10 * j + 100 * k; }, Interpolation::nearest);
  EXPECT_EQ(field(0.5, 0, 0), 1);
  EXPECT_EQ(field(std::nextafter(1.5, 0), 0, 0), 1);
  EXPECT_EQ(field(1.5, 0.5, 0.5), 112);
  EXPECT_EQ(field(-0.5, -0.5, -0.5), 0);
  EXPECT_EQ(field(3.5, 2.5, 1.5), 123);
  EXPECT_EQ(field(2.49, 1.51, 0.49), 22);
}

TEST(NearestInterpolation, HasNoValueInVoxelsThatAreNotFiniteWhateverTheirNeighbours) {
  const Field field(
      {5, 1, 1}, [](int i, int, int) { return i == 2 ? kNaN : i; }, Interpolation::nearest);
  EXPECT_EQ(field(1.49, 0, 0), 1);
  EXPECT_TRUE(std::isnan(field(1.5, 0, 0)));
  EXPECT_TRUE(std::isnan(field(2.49, 0, 0)));
  EXPECT_EQ(field(2.5, 0, 0), 3);
}

TEST(NearestInterpolation, HasTheGradientOfTrilinear) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto voxels = [&](int, int, int) { return unit(random) < 0.02 ? kNaN : unit(random); };
  const Volume volume = makeVolume(gridOf({6, 5, 7}), {voxels});
  const ScalarField nearest(volume.channels()[0], {6, 5, 7}, Interpolation::nearest),
      trilinear(volume.channels()[0], {6, 5, 7});
  int zero = 0;
  for (int i = 0; i < 500; ++i) {
    const glm::dvec3 p = glm::dvec3(unit(random), unit(random), unit(random)) * glm::dvec3(6, 5, 7) - 0.5;
    EXPECT_EQ(nearest.gradient(p), trilinear.gradient(p));
    zero += nearest.gradient(p) == glm::dvec3(0);
  }
  EXPECT_GT(zero, 20);
  EXPECT_LT(zero, 480);
}

}  // namespace
}  // namespace scolopax::reference
