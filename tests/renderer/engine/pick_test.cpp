// SPDX-License-Identifier: Apache-2.0
// Picks agree with the picture: closed forms for every method and blend mode.
#include "renderer/data/pick.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "renderer/renderer.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

constexpr Method kMethodsAndAutomatic[] = {Method::automatic, Method::superposed, Method::cumulative,
                                           Method::syncDda,   Method::nDda,       Method::raymarch,
                                           Method::hybrid};

std::vector<Picked> pickedIn(const Renderer& renderer, const Scene& scene, const PixelArea& area) {
  const auto picking = renderer.pick(scene, area);
  EXPECT_TRUE(picking->run(kNever, Renderer::kNoBudget));
  return picking->found();
}

std::vector<Picked> pickedIn(const std::shared_ptr<const Volume>& volume, const Scene& scene,
                             const PixelArea& area) {
  const auto renderer = makeCpuRenderer(volume, 1);
  renderer->setScene(scene);
  return pickedIn(*renderer, scene, area);
}

/// An opaque ball, a level set of a distance, in anisotropic voxels; a second channel is empty.
struct Ball {
  static constexpr double kRadius = 5;
  const glm::dvec3 spacing{0.5, 0.75, 1};
  glm::dvec3 centre;
  std::shared_ptr<const Volume> volume;
  Scene scene;
  Ball() {
    const glm::ivec3 dims(24, 16, 12);
    const glm::dvec3 origin(100, -20, 3);
    centre = origin + glm::dvec3(dims - 1) * 0.5 * spacing;
    const auto level = [&](int x, int y, int z) {
      return kRadius - glm::length(origin + glm::dvec3(x, y, z) * spacing - centre);
    };
    volume = volumeOf(gridOf(dims, spacing, origin), channelOf<float>(dims, [](int, int, int) { return -1; }),
                      channelOf<float>(dims, level));
    scene = frontScene(*volume, 40, 24);
    scene.step = 0.05;
    for (ChannelAppearance& channel : scene.channels) {
      channel.rangeLo = channel.rangeHi = 0;  // a step
      channel.density = 1e4;
    }
  }
};

/// Interpolating a distance between voxels is off by at most the sum of spacing^2 / (8 x distance); plus a
/// step of the marcher.
const double kBallTolerance = (0.25 + 0.5625 + 1) / (8 * 4.5) + 0.03;

TEST(Pick, OfAnOpaqueBallIsItsSurface) {
  for (const Method method : kMethodsAndAutomatic)
    for (const BlendMode blend : kBlends)
      for (const bool perspective : {false, true}) {
        SCOPED_TRACE(testing::Message() << nameOf(method) << " " << nameOf(blend) << " " << perspective);
        Ball ball;
        ball.scene.method = method;
        ball.scene.blend = blend;
        Camera& camera = ball.scene.camera;
        const double height = *camera.orthoHeight;
        if (perspective) {
          camera.orthoHeight.reset();
          camera.eye = ball.centre - glm::dvec3(0, 0, 30);
          camera.fovY = 25;
        }
        for (const glm::ivec2 pixel : {glm::ivec2(20, 12), {14, 9}, {23, 17}}) {
          const auto found = pickedIn(ball.volume, ball.scene, {pixel.x, pixel.y, 1, 1});
          ASSERT_EQ(found.size(), 1u);
          const Picked& hit = found.front();
          EXPECT_NEAR(glm::length(hit.point - ball.centre), Ball::kRadius, kBallTolerance);
          EXPECT_LT(hit.point.z, ball.centre.z);  // the near side
          EXPECT_EQ(hit.channel, 1);
          EXPECT_NEAR(hit.depth, hit.point.z - camera.eye.z, 1e-4);
          const glm::dmat4 voxelFromWorld = glm::inverse(ball.volume->grid().worldFromVoxel);
          EXPECT_LT(glm::length(glm::dvec3(voxelFromWorld * glm::dvec4(hit.point, 1)) - hit.voxel), 1e-6);
          // The point projects into the pixel: the view is along z with y up, so right is -x.
          const double scale =
              perspective
                  ? 24 / (2 * std::tan(camera.fovY * 3.14159265358979 / 360) * (hit.point.z - camera.eye.z))
                  : 24 / height;
          const double x = 20 - (hit.point.x - ball.centre.x) * scale;
          const double y = 12 - (hit.point.y - ball.centre.y) * scale;
          EXPECT_GT(x, pixel.x - 1e-3);
          EXPECT_LT(x, pixel.x + 1 + 1e-3);
          EXPECT_GT(y, pixel.y - 1e-3);
          EXPECT_LT(y, pixel.y + 1 + 1e-3);
        }
      }
}

/// Calls f(scene, volume, distance of the hit from the ball's centre) for every method and blend mode, for a
/// pick in the middle of the ball after change(ball).
template <class Change, class F>
void forPicksInTheMiddle(const Change& change, const F& f) {
  for (const Method method : kMethodsAndAutomatic)
    for (const BlendMode blend : kBlends) {
      SCOPED_TRACE(testing::Message() << nameOf(method) << " " << nameOf(blend));
      Ball ball;
      ball.scene.method = method;
      ball.scene.blend = blend;
      change(ball);
      f(ball, pickedIn(ball.volume, ball.scene, {20, 12, 1, 1}));
    }
}

TEST(Pick, OfWhatIsCutOpenIsTheCut) {
  const auto isAt = [](double distance, double tolerance) {
    return [=](const Ball& ball, const std::vector<Picked>& found) {
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].channel, 1);
      EXPECT_NEAR(found[0].point.z, ball.centre.z - distance, tolerance);
    };
  };
  for (const bool ofSome : {false, true})
    forPicksInTheMiddle(
        [&](Ball& ball) {
          ClipPlane plane{ball.centre - glm::dvec3(0, 0, 2), {0, 0, 1}, {}};
          if (ofSome) plane.channels = {1};
          ball.scene.clip = {plane};
        },
        isAt(2, 0.03));
  forPicksInTheMiddle(
      [](Ball& ball) {
        ball.scene.crop = Crop{{-1, -1, 4}, {30, 30, 30}, 1u << 13};
      },
      isAt(1.5, 0.03));
  // The region in front of both planes is kept as well: nothing is cut off.
  forPicksInTheMiddle(
      [](Ball& ball) {
        ball.scene.crop = Crop{{-1, -1, 4}, {30, 30, 30}, 1u << 13 | 1u << 4};
      },
      isAt(Ball::kRadius, kBallTolerance));
}

TEST(Pick, OfASurfaceIsOnIt) {
  for (const Interpolation how : {Interpolation::trilinear, Interpolation::cubic})
    forPicksInTheMiddle(
        [&](Ball& ball) {
          ball.scene.channels[1].opacity = {{0, 0}};
          ball.scene.channels[1].isovalues = {{0, 1, glm::dvec3(1)}};
          ball.scene.channels[1].interpolation = how;
        },
        [](const Ball& ball, const std::vector<Picked>& found) {
          ASSERT_EQ(found.size(), 1u);
          EXPECT_EQ(found[0].channel, 1);
          EXPECT_NEAR(glm::length(found[0].point - ball.centre), Ball::kRadius, 2 * kBallTolerance);
        });
}

TEST(Pick, IsOfTheValuesThatTheInterpolationGives) {
  // The spline smooths: it is off by a sixth of the sum of spacing^2 times the second derivatives, which are
  // 1 / radius in two directions. The nearest voxel is at most half a voxel away.
  const double ofSpline = (0.25 + 0.5625) / (6 * 4.5), ofNearest = 0.5;
  for (const Interpolation how : {Interpolation::cubic, Interpolation::nearest})
    forPicksInTheMiddle(
        [&](Ball& ball) { ball.scene.channels[1].interpolation = how; },
        [&](const Ball& ball, const std::vector<Picked>& found) {
          ASSERT_EQ(found.size(), 1u);
          EXPECT_NEAR(glm::length(found[0].point - ball.centre), Ball::kRadius,
                      how == Interpolation::cubic ? ofSpline + kBallTolerance : ofNearest + kBallTolerance);
        });
}

TEST(Pick, IsOfTheMatterThatTheGradientLeaves) {
  // The gradient of a distance is 1, except in the middle of the ball.
  for (const bool shown : {true, false})
    forPicksInTheMiddle(
        [&](Ball& ball) {
          const double low = shown ? 0 : 1;
          ball.scene.channels[1].gradientOpacity =
              GradientOpacity{0, 1, {{0.3, low}, {0.3, 1 - low}, {1, 1 - low}}};
        },
        [&](const Ball& ball, const std::vector<Picked>& found) {
          if (shown) {
            ASSERT_EQ(found.size(), 1u);
            EXPECT_NEAR(glm::length(found[0].point - ball.centre), Ball::kRadius, kBallTolerance);
          } else if (!found.empty()) {
            EXPECT_LT(glm::length(found[0].point - ball.centre), 2);
          }
        });
}

TEST(Pick, OfTheFilterPointIsOnTheRayThroughThePixelsCentre) {
  Ball ball;
  ball.scene.filter = PixelFilter::point;
  const auto found = pickedIn(ball.volume, ball.scene, {14, 9, 1, 1});
  ASSERT_EQ(found.size(), 1u);
  const double pixel = *ball.scene.camera.orthoHeight / 24;
  EXPECT_NEAR(found[0].point.x, ball.centre.x + (20 - 14.5) * pixel, 1e-4);
  EXPECT_NEAR(found[0].point.y, ball.centre.y + (12 - 9.5) * pixel, 1e-4);
}

TEST(Pick, FromAFarEyeIsAsFine) {
  Ball ball;
  ball.scene.camera.eye.z = ball.centre.z - 1e7;
  const auto found = pickedIn(ball.volume, ball.scene, {20, 12, 1, 1});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(glm::length(found[0].point - ball.centre), Ball::kRadius, kBallTolerance);
}

TEST(Pick, FindsNothingWhereNothingIsSeen) {
  for (const Method method : kMethodsAndAutomatic) {
    Ball ball;
    ball.scene.method = method;
    EXPECT_TRUE(pickedIn(ball.volume, ball.scene, {0, 0, 1, 1}).empty()) << nameOf(method);  // beside the box
    EXPECT_TRUE(pickedIn(ball.volume, ball.scene, {12, 1, 1, 1}).empty())
        << nameOf(method);  // beside the ball
    ball.scene.channels[1].visible = false;
    EXPECT_TRUE(pickedIn(ball.volume, ball.scene, {20, 12, 1, 1}).empty()) << nameOf(method);
  }
}

TEST(Pick, OfAnAreaIsThatOfItsPixels) {
  const Ball ball;
  // Each of 8 x 8 pixels has as many samples as a single pixel, and gives the same hit.
  const auto found = pickedIn(ball.volume, ball.scene, {8, 2, 8, 8});
  std::size_t at = 0;
  for (int y = 2; y < 10; ++y)
    for (int x = 8; x < 16; ++x)
      for (const Picked& alone : pickedIn(ball.volume, ball.scene, {x, y, 1, 1})) {
        ASSERT_LT(at, found.size());
        EXPECT_EQ(found[at++].point, alone.point);
      }
  EXPECT_EQ(at, found.size());
  EXPECT_GT(at, 0u);
  EXPECT_LT(at, 64u);
}

/// A slab of 4 x 4 x 4 world units: the front half is channel 0, the back half channel 1.
struct Slab {
  std::shared_ptr<const Volume> volume;
  Scene scene;
  Slab(double front, double back) {
    const glm::ivec3 dims(8, 8, 8);
    volume = volumeOf(gridOf(dims, glm::dvec3(0.5)),
                      channelOf<std::uint8_t>(dims, [](int, int, int z) { return z < 4 ? 1 : 0; }),
                      channelOf<std::uint8_t>(dims, [](int, int, int z) { return z < 4 ? 0 : 1; }));
    scene = frontScene(*volume, 6, 6);
    scene.step = 0.1;
    for (std::size_t i = 0; i < 2; ++i) {
      scene.channels[i].rangeLo = scene.channels[i].rangeHi = 0.5;
      scene.channels[i].density = i == 0 ? front : back;
    }
  }
  double depthOfMiddle() const { return volume->grid().diagonal(); }
};

TEST(Pick, IsOfTheChannelInWhichMostSamplesEnd) {
  for (const Method method : kMethodsAndAutomatic)
    for (const BlendMode blend : kBlends) {
      SCOPED_TRACE(testing::Message() << nameOf(method) << " " << nameOf(blend));
      // 1 - e^-0.4 = 0.33 of the rays end in front, the others at the face of the back half.
      Slab slab(0.2, 1e4);
      slab.scene.method = method;
      slab.scene.blend = blend;
      auto found = pickedIn(slab.volume, slab.scene, {3, 3, 1, 1});
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].channel, 1);
      EXPECT_NEAR(found[0].depth, slab.depthOfMiddle(), 0.06);
      // With 1 - e^-4 = 0.98 the front is hit, and half of the rays end within ln 2 / 2 (with an uncertainty
      // from 64 samples).
      slab.scene.channels[0].density = 2;
      found = pickedIn(slab.volume, slab.scene, {3, 3, 1, 1});
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].channel, 0);
      EXPECT_NEAR(found[0].depth, slab.depthOfMiddle() - 2 + 0.34, 0.25);
    }
}

TEST(Pick, TakesWhatIsFaintButNotWhatIsHardlyThere) {
  for (const Method method : kMethodsAndAutomatic) {
    // Of 64 samples, 16 are expected to end, and then 0.3.
    Slab slab(0, -std::log(1 - 0.25) / 2);
    slab.scene.method = method;
    EXPECT_EQ(pickedIn(slab.volume, slab.scene, {2, 4, 1, 1}).size(), 1u) << nameOf(method);
    slab.scene.channels[1].density = -std::log(1 - 0.005) / 2;
    EXPECT_TRUE(pickedIn(slab.volume, slab.scene, {2, 4, 1, 1}).empty()) << nameOf(method);
  }
}

TEST(Pick, IsTheSameWhateverIsLitOrDrawnForAWhile) {
  for (const Method method : kMethodsAndAutomatic) {
    Slab slab(0.3, 0.6);
    slab.scene.method = method;
    const auto plain = pickedIn(slab.volume, slab.scene, {3, 2, 1, 1});
    ASSERT_EQ(plain.size(), 1u);
    Scene lit = slab.scene;
    lit.shading = lit.shadows = true;
    EXPECT_EQ(pickedIn(slab.volume, lit, {3, 2, 1, 1}).at(0).point, plain[0].point) << nameOf(method);
    // While edits arrive, the renderer makes a smaller and coarser picture.
    Scene coarse = slab.scene;
    coarse.width = coarse.height = 3;
    coarse.filter = PixelFilter::point;
    coarse.method = Method::hybrid;
    coarse.step = 2;
    const auto renderer = makeCpuRenderer(slab.volume, 1);
    renderer->setScene(coarse);
    EXPECT_EQ(pickedIn(*renderer, slab.scene, {3, 2, 1, 1}).at(0).point, plain[0].point) << nameOf(method);
  }
}

TEST(Pick, StaysWithItsSceneWhateverComesAfter) {
  const Ball ball;
  auto renderer = makeCpuRenderer(ball.volume, 1);
  renderer->setScene(ball.scene);
  const PixelArea area{8, 2, 16, 16};
  const auto expected = pickedIn(*renderer, ball.scene, area);
  const auto picking = renderer->pick(ball.scene, area);
  Scene other = ball.scene;
  for (ChannelAppearance& channel : other.channels) channel.opacity = {{0, 0}, {1, 0}};
  other.macrocell = ball.scene.macrocell + 1;
  renderer->setScene(other);
  renderer.reset();
  EXPECT_TRUE(picking->run(kNever, Renderer::kNoBudget));
  ASSERT_EQ(picking->found().size(), expected.size());
  ASSERT_FALSE(expected.empty());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(picking->found()[i].point, expected[i].point);
}

TEST(Pick, GoesOnWhereItsBudgetEnded) {
  const Ball ball;
  const auto renderer = makeCpuRenderer(ball.volume, 1);
  renderer->setScene(ball.scene);
  const auto picking = renderer->pick(ball.scene, {8, 2, 16, 16});
  EXPECT_FALSE(picking->run(kNever, std::chrono::nanoseconds(0)));
  int slices = 1;
  while (!picking->run(kNever, std::chrono::microseconds(100))) ++slices;
  EXPECT_GT(slices, 1);
  const auto whole = pickedIn(*renderer, ball.scene, {8, 2, 16, 16});
  ASSERT_EQ(picking->found().size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_EQ(picking->found()[i].point, whole[i].point);
}

TEST(Pick, EndsWhenItIsCancelledAndGoesOnLater) {
  for (const Method method : {Method::superposed, Method::raymarch}) {
    Ball ball;
    ball.scene.method = method;
    const auto renderer = makeCpuRenderer(ball.volume, 1);
    renderer->setScene(ball.scene);
    const auto picking = renderer->pick(ball.scene, {20, 12, 2, 1});
    const std::atomic<bool> cancelled{true};
    EXPECT_FALSE(picking->run(cancelled, Renderer::kNoBudget));
    EXPECT_EQ(picking->samples(), 0u);  // not even the first ray counts: it may have ended too early
    EXPECT_TRUE(picking->run(kNever, Renderer::kNoBudget));
    EXPECT_EQ(picking->samples(), 2u * 64);
    const auto whole = pickedIn(*renderer, ball.scene, {20, 12, 2, 1});
    ASSERT_EQ(picking->found().size(), 2u);
    ASSERT_EQ(whole.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(picking->found()[i].point, whole[i].point);
  }
}

}  // namespace
}  // namespace scolopax
