// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/visible_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "tests/support/volumes.h"

namespace scolopax {
namespace {

constexpr double kFovY = 35, kAspect = 1.25;

/// Distance of a voxel's centre from the middle of the frame; 1 at the frame's edge.
double placeInFrame(const Camera& camera, const Grid& grid, glm::dvec3 voxel) {
  const glm::dvec3 p = glm::dvec3(grid.worldFromVoxel * glm::dvec4(voxel, 1)) - camera.eye;
  const glm::dvec3 forward = glm::normalize(camera.target - camera.eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up)), up = glm::cross(right, forward);
  const double tan = std::tan(glm::radians(kFovY / 2)), away = glm::dot(p, forward);
  if (away <= 0) return INFINITY;
  return std::max(std::abs(glm::dot(p, right)) / kAspect, std::abs(glm::dot(p, up))) / (away * tan);
}

Camera cameraFor(const Volume& volume, const std::vector<ChannelAppearance>& channels) {
  const auto hull = visibleHull(volume.facts(), buildCoarseMacrocells(volume), channels);
  return framingCamera(volume.grid(), kFovY, kAspect, hull);
}

/// Opaque above `from`.
ChannelAppearance above(double from, double to = 255) {
  ChannelAppearance look;
  look.rangeLo = from;
  look.rangeHi = to;
  return look;
}

constexpr glm::ivec3 kBallDims{120, 90, 70};

bool inBall(glm::dvec3 p, glm::dvec3 centre, double radius) { return glm::length(p - centre) <= radius; }

/// A ball of 200 in a volume of 3.
template <class T>
ChannelSource ball(glm::dvec3 centre, double radius) {
  return test::channelOf<T>(kBallDims, [=](int x, int y, int z) {
    return inBall({x, y, z}, centre, radius) ? 200.0 : 3.0;
  });
}

template <class F>
void forVoxels(F&& f) {
  for (int z = 0; z < kBallDims.z; ++z)
    for (int y = 0; y < kBallDims.y; ++y)
      for (int x = 0; x < kBallDims.x; ++x) f(glm::dvec3(x, y, z));
}

/// Largest distance of the ball's voxels from the middle of the frame.
double reachOfBall(const Camera& camera, const Grid& grid, glm::dvec3 centre, double radius) {
  double reach = 0;
  forVoxels([&](glm::dvec3 p) {
    if (inBall(p, centre, radius)) reach = std::max(reach, placeInFrame(camera, grid, p));
  });
  return reach;
}

TEST(VisibleHull, FillsTheFrameWithWhatCanBeSeenAndNotWithTheBox) {
  const glm::dvec3 centre(80, 30, 25);
  for (const bool real : {false, true}) {
    const auto made = test::volumeOf(test::gridOf(kBallDims),
                                     real ? ball<float>(centre, 18) : ball<std::uint8_t>(centre, 18));
    const Volume& volume = *made;
    const Camera camera = cameraFor(volume, {above(10)});
    const double reach = reachOfBall(camera, volume.grid(), centre, 18);
    EXPECT_LT(reach, 1);
    EXPECT_GT(reach, 0.8);
    const Camera box = framingCamera(volume.grid(), kFovY, kAspect);
    EXPECT_LT(reachOfBall(box, volume.grid(), centre, 18), 0.5);
  }
}

TEST(VisibleHull, LeavesOutNothingThatCanBeSeen) {
  // One voxel just above the threshold, far from everything else: the values interpolated around it are
  // visible too.
  const auto value = [](int x, int y, int z) {
    if (x == 117 && y == 87 && z == 3) return 12.0;
    return inBall({x, y, z}, {30, 40, 30}, 10) ? 200.0 : 3.0;
  };
  const auto made = test::volumeOf(test::gridOf(kBallDims), test::channelOf<std::uint8_t>(kBallDims, value));
  const Volume& volume = *made;
  const Camera camera = cameraFor(volume, {above(11)});
  EXPECT_LT(placeInFrame(camera, volume.grid(), {117, 87, 3}), 1);
  EXPECT_LT(reachOfBall(camera, volume.grid(), {30, 40, 30}, 10), 1);
  const Camera without = cameraFor(volume, {above(13)});
  EXPECT_GT(placeInFrame(without, volume.grid(), {117, 87, 3}), 1);
}

TEST(VisibleHull, HoldsEveryVoxelOfRandomScenesThatHasOpacity) {
  unsigned state = 1;
  const auto random = [&] { return state = state * 1664525u + 1013904223u, double(state >> 8) / (1 << 24); };
  for (int round = 0; round < 5; ++round) {
    std::vector<glm::dvec4> balls;
    for (int i = 0; i < 3; ++i)
      balls.push_back({random() * 120, random() * 90, random() * 70, 1 + 12 * random()});
    const auto value = [&](int x, int y, int z) {
      double most = 0;
      for (const glm::dvec4& b : balls)
        most = std::max(most, 250 - 100 * glm::length(glm::dvec3(x, y, z) - glm::dvec3(b)) / b.w);
      return std::max(most, 0.0);
    };
    const auto made =
        test::volumeOf(test::gridOf(kBallDims), test::channelOf<std::uint16_t>(kBallDims, value));
    const Volume& volume = *made;
    const ChannelAppearance look = above(100 + 100 * random());
    const Camera camera = cameraFor(volume, {look});
    forVoxels([&](glm::dvec3 p) {
      if (!(std::round(value(int(p.x), int(p.y), int(p.z))) > look.rangeLo)) return;
      ASSERT_LE(placeInFrame(camera, volume.grid(), p), 1) << round;
    });
  }
}

TEST(VisibleHull, FramesAllVisibleChannelsAndNoneThatIsNot) {
  const glm::dvec3 left(25, 45, 35), right(95, 45, 35);
  const auto made =
      test::volumeOf(test::gridOf(kBallDims), ball<std::uint8_t>(left, 8), ball<std::uint8_t>(right, 8));
  const Volume& volume = *made;
  std::vector<ChannelAppearance> looks{above(10), above(10)};
  Camera camera = cameraFor(volume, looks);
  EXPECT_LT(reachOfBall(camera, volume.grid(), left, 8), 1);
  EXPECT_LT(reachOfBall(camera, volume.grid(), right, 8), 1);
  const auto alone =
      cameraFor(*test::volumeOf(test::gridOf(kBallDims), ball<std::uint8_t>(left, 8)), {above(10)});
  looks[1].visible = false;
  EXPECT_EQ(cameraFor(volume, looks), alone);
  looks[1].visible = true;
  looks[1].density = 0;
  EXPECT_EQ(cameraFor(volume, looks), alone);
  looks[1].density = 1;
  looks[1].opacity = {{0, 0}};
  EXPECT_EQ(cameraFor(volume, looks), alone);
}

TEST(VisibleHull, HoldsTheSplineOfAVoxel) {
  // It extends to the second voxel on each side. Cells of two voxels begin at even ones.
  const auto made = test::volumeOf(test::gridOf(kBallDims),
                                   test::channelOf<std::uint8_t>(kBallDims, [](int x, int y, int z) {
                                     return glm::ivec3(x, y, z) == glm::ivec3(61, 45, 35) ? 255.0 : 0.0;
                                   }));
  ChannelAppearance look = above(0.1);
  for (const Interpolation how : {Interpolation::trilinear, Interpolation::cubic}) {
    look.interpolation = how;
    const double reach = how == Interpolation::cubic ? 1.9 : 0.9;
    const auto hull = visibleHull(made->facts(), buildCoarseMacrocells(*made), std::vector{look});
    glm::vec3 low(1e9f), high(-1e9f);
    for (const glm::vec3& point : hull) low = glm::min(low, point), high = glm::max(high, point);
    for (int axis = 0; axis < 3; ++axis) {
      const double centre = glm::ivec3(61, 45, 35)[axis];
      EXPECT_LE(low[axis], centre - reach) << int(how);
      EXPECT_GE(high[axis], centre + reach) << int(how);
    }
  }
}

TEST(VisibleHull, IsEmptyWhereNothingCanBeSeenAndThenTheBoxIsFramed) {
  const auto made = test::volumeOf(test::gridOf(kBallDims), ball<std::uint8_t>({60, 45, 35}, 8));
  const Volume& volume = *made;
  EXPECT_TRUE(visibleHull(volume.facts(), buildCoarseMacrocells(volume), std::vector{above(220)}).empty());
  EXPECT_EQ(cameraFor(volume, {above(220)}), framingCamera(volume.grid(), kFovY, kAspect));
}

TEST(VisibleHull, IsTheBoxWhereAllCanBeSeen) {
  for (const glm::ivec3 dims : {glm::ivec3(1), glm::ivec3(40, 30, 1), glm::ivec3(200, 3, 65)}) {
    const auto made = test::volumeOf(
        test::gridOf(dims), test::channelOf<std::uint8_t>(dims, [](int, int, int) { return 100.0; }));
    const Volume& volume = *made;
    EXPECT_EQ(cameraFor(volume, {above(10)}), framingCamera(volume.grid(), kFovY, kAspect)) << dims.x;
  }
}

TEST(VisibleHull, LooksAtFewCells) {
  const glm::ivec3 dims(500, 40, 2);
  const auto made = test::volumeOf(
      test::gridOf(dims), test::channelOf<std::uint8_t>(dims, [](int x, int, int) { return x % 7 * 30.0; }));
  const Volume& volume = *made;
  const MacrocellGrid cells = buildCoarseMacrocells(volume);
  EXPECT_LE(std::max({cells.cells.x, cells.cells.y, cells.cells.z}), 64);
  EXPECT_GE(cells.cells.x, 32);
}

}  // namespace
}  // namespace scolopax
