// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/scalar_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

/// The value of voxel (i,j,k): i^2 + 10 j k.
double curved(int i, int j, int k) { return i * i + 10 * j * k; }

TEST(ScalarField, InterpolatesBetweenVoxelsAndIsClampedBeyond) {
  const Volume volume = makeVolume(gridOf({5, 4, 3}), {curved});
  const ScalarField field(volume.channels()[0], {5, 4, 3});
  EXPECT_EQ(field({3, 2, 1}), 29);
  EXPECT_NEAR(field({1.25, 2, 1}), 20 + 1 + 0.25 * 3, 1e-14);
  EXPECT_NEAR(field({0, 1.5, 0.5}), 10 * 1.5 * 0.5, 1e-14);
  EXPECT_EQ(field({-0.5, 3, 2}), 60);
  EXPECT_EQ(field({4.5, 3.5, 2.5}), 76);
}

TEST(ScalarField, GradientIsTheCentralDifferenceAndOneSidedAtTheBorder) {
  const Volume volume = makeVolume(gridOf({5, 4, 3}), {curved});
  const ScalarField field(volume.channels()[0], {5, 4, 3});
  EXPECT_EQ(field.gradient({2, 1, 1}), glm::dvec3(4, 10, 10));
  EXPECT_EQ(field.gradient({2.5, 1, 1}).x, 5);          // f(3.5) - f(1.5) = 12.5 - 2.5, over 2
  EXPECT_EQ(field.gradient({0, 1, 1}).x, 1);            // (1 - 0) / 1
  EXPECT_EQ(field.gradient({0.5, 1, 1}).x, 2.5 / 1.5);  // (f(1.5) - f(0)) / 1.5
  EXPECT_EQ(field.gradient({4, 1, 1}).x, 7);            // (16 - 9) / 1
  EXPECT_EQ(field.gradient({4.5, 1, 1}).x, 7);          // the outer half voxel: as at the outer centre
  EXPECT_EQ(field.gradient({-0.5, 1, 1}).x, 1);
}

TEST(ScalarField, GradientIsZeroWhereAValueIsNotFiniteAndAlongASingleLayer) {
  const Volume volume = makeVolume(gridOf({6, 3, 1}), {[](int i, int j, int) {
                                     return i == 4 ? std::numeric_limits<double>::infinity() : i + j;
                                   }});
  const ScalarField field(volume.channels()[0], {6, 3, 1});
  EXPECT_EQ(field.gradient({1.5, 1, 0}), glm::dvec3(1, 1, 0));
  EXPECT_EQ(field.gradient({2.5, 1, 0}), glm::dvec3(0));
  EXPECT_TRUE(std::isnan(field({3.5, 1, 0})));
}

TEST(ScalarField, GradientIsOfDataValues) {
  std::vector<ChannelSource> channels(1);
  channels[0].voxels = VoxelBuffer(ScalarType::u8, 3);
  const auto stored = channels[0].voxels.as<std::uint8_t>();
  stored[0] = 10, stored[1] = 20, stored[2] = 50;
  channels[0].slope = -0.5;
  channels[0].intercept = 7;
  const Volume volume(gridOf({3, 1, 1}), std::move(channels));
  EXPECT_EQ(ScalarField(volume.channels()[0], {3, 1, 1}).gradient({1, 0, 0}), glm::dvec3(-10, 0, 0));
}

}  // namespace
}  // namespace scolopax::reference
