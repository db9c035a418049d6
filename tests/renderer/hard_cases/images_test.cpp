// SPDX-License-Identifier: Apache-2.0
// Whole pictures whose pixels are known exactly: sizes, faces, neighbours, hidden channels and channels
// without finite voxels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "renderer/core/error.h"
#include "renderer/data/film.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/trackers/close_look.h"
#include "tests/renderer/hard_cases/hard_scenes.h"

namespace scolopax {
namespace {

using namespace test;

double largestAlpha(const Image& image) {
  float largest = 0;
  for (const glm::vec4& p : image.pixels) largest = std::max(largest, p.a);
  return double(largest);
}

TEST(Film, DoesNotDriftInTenMillionSamples) {
  Film film;
  film.reset(1, 1);
  for (int i = 0; i < 10'000'000; ++i) {
    film.pass()[0] = glm::vec4(0.1f, 0.7f, 1e-6f, 1.0f);
    film.add();
  }
  ASSERT_EQ(film.samples(), 10'000'000u);
  EXPECT_EQ(film.image().pixels[0], glm::vec4(0.1f, 0.7f, 1e-6f, 1.0f));
  // Sums of n terms have a relative error of at most n 2^-53: the halves differ by no more.
  EXPECT_LT(film.noise(), 10'000'000 * 0x1p-53);
}

/// Adds passes to a film of one pixel, in which one component of each has a value of its own.
void addPasses(Film& film, int count, int component, double (*value)(int pass)) {
  for (int i = 0; i < count; ++i) {
    film.pass()[0] = glm::vec4(0, 0, 0, 1);
    film.pass()[0][component] = float(value(i));
    film.add();
  }
}

TEST(Film, TakesItsNoiseFromTheDifferenceOfItsHalves) {
  // The halves' means are 1 and 0: the variance of the mean of all is (1 - 0)^2 / 4, in one of four
  // components, which may be alpha. Differences within a half do not count: samples of low discrepancy
  // differ, and yet their mean is right.
  for (const int component : {0, 3}) {
    Film film;
    film.reset(1, 1);
    addPasses(film, 16, component, [](int i) { return double(i % 2); });
    EXPECT_NEAR(film.noise(), std::sqrt(1.0 / 4 / 4), 1e-9);
    film.reset(1, 1);
    addPasses(film, 16, component, [](int i) { return double(i / 2 % 2); });
    EXPECT_NEAR(film.noise(), 0, 1e-9);
  }
}

TEST(Film, KnowsItsNoiseAtAnyNumberOfSamples) {
  // Independent samples of variance 1/12, over 10,000 pixels: 3 % is more than four standard deviations of
  // the estimate.
  Film film;
  film.reset(100, 100);
  std::uint32_t state = 1;
  for (int n = 1; n <= 9; ++n) {
    for (std::size_t i = 0; i < film.pixelCount(); ++i) {
      state = kernel::hashOf(state + 0x9e3779b9u);
      film.pass()[i] = glm::vec4(0, float(kernel::uniformOf(state)), 0, 0);
    }
    film.add();
    if (n == 1)
      EXPECT_TRUE(std::isnan(film.noise()));
    else
      EXPECT_NEAR(film.noise() / std::sqrt(1.0 / 12 / n / 4), 1, 0.03) << n;
  }
}

TEST(Film, AddsTheMeanOfEveryLevelOfCorrections) {
  Film film;
  film.reset(1, 1);
  addPasses(film, 3, 0, [](int) { return 0.5; });
  for (int level = 0; level < 2; ++level) {
    film.addLevel();
    EXPECT_EQ(film.corrections(std::size_t(level)), 0u);
  }
  EXPECT_EQ(film.image().pixels[0], glm::vec4(0.5f, 0, 0, 1));
  const auto correct = [&](std::size_t level, float by) {
    film.fine()[0] = glm::vec4(0.25f + by, 0, 0, 0.5f);
    film.coarse()[0] = glm::vec4(0.25f, 0, 0, 0.75f);
    film.addCorrection(level);
  };
  correct(0, 0.25f);
  EXPECT_EQ(film.image().pixels[0], glm::vec4(0.5f, 0, 0, 1));
  EXPECT_EQ(film.noise(), 0);
  film.include(0);
  EXPECT_EQ(film.image().pixels[0], glm::vec4(0.75f, 0, 0, 0.75f));
  // A single correction counts as noise of its own size.
  EXPECT_NEAR(film.noise(), std::sqrt((0.25 * 0.25 + 0.25 * 0.25) / 4), 1e-9);
  correct(0, -0.75f);
  correct(1, 0.5f);
  film.include(1);
  EXPECT_EQ(film.image().pixels[0], glm::vec4(0.75f, 0, 0, 0.5f));
  EXPECT_EQ(film.corrections(0), 2u);
  // The product of both corrections of level 0 is negative. The result is the standard deviation of the
  // estimate: half of the squared difference between the corrections, divided by the root of the number of
  // components.
  EXPECT_NEAR(film.correctionSize(0), std::sqrt(0.5 / 2 / 4), 1e-6);
  film.reset(1, 1);
  EXPECT_EQ(film.levels(), 0u);
}

TEST(Film, EstimatesTheSizeOfALevelsCorrectionsWithoutTheirNoise) {
  // The expected correction is 0.01 in one component; its noise is 10 times as large.
  Film film;
  film.reset(200, 200);
  film.addLevel();
  std::uint32_t state = 1;
  for (int n = 0; n < 4; ++n) {
    for (std::size_t i = 0; i < film.pixelCount(); ++i) {
      state = kernel::hashOf(state + 0x9e3779b9u);
      film.fine()[i] = glm::vec4(0, 0, 0.01f + 0.35f * (float(kernel::uniformOf(state)) - 0.5f), 0);
      film.coarse()[i] = glm::vec4(0);
    }
    film.addCorrection(0);
  }
  // The square is 1e-4 with a standard deviation of 0.01 / 4 / sqrt(40000).
  EXPECT_NEAR(std::pow(film.correctionSize(0), 2), 1e-4 / 4, 5 * 0.0025 / 200 / 4);
}

TEST(Picture, OfOnePixelIsThatOfTheRayThroughItsCentre) {
  const glm::ivec3 dims(4, 4, 4);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  for (const Method method : kTrackers) {
    Scene scene = frontScene(*volume, 1, 1);
    scene.channels[0] = solid(1e6, kGreen);
    const Image image = renderAnalog(volume, scene, method, 3);
    ASSERT_EQ(image.pixels.size(), 1u);
    EXPECT_EQ(image.pixels[0], glm::vec4(0, 1, 0, 1));
  }
}

TEST(Picture, Of8KHasEveryPixelAndItsCornersInTheirPlaces) {
  const glm::ivec3 dims(16, 9, 1);
  // 0 inside, 1 to 4 in the corners; within half a voxel of both faces a corner has its own value.
  const auto corner = [](int x, int y, int) {
    return (x == 0 || x == 15) && (y == 0 || y == 8) ? 1 + (x == 15) + 2 * (y == 8) : 0;
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, corner));
  Scene scene = frontScene(*volume, 7680, 4320);
  scene.channels[0] = solid(1e6);
  scene.channels[0].rangeHi = 4;
  scene.channels[0].color = {{0, glm::dvec3(0)}, {0.25, kRed}, {0.5, kGreen}, {0.75, kBlue}, {1, kWhite}};
  const Image image = renderAnalog(volume, scene, Method::superposed, 1);
  ASSERT_EQ(image.pixels.size(), 7680u * 4320u);
  std::size_t opaque = 0;
  for (const glm::vec4& p : image.pixels) opaque += p.a == 1;
  EXPECT_EQ(opaque, image.pixels.size());
  // Seen along +z with y up, x increases to the left.
  const std::size_t right = 7679, bottom = 4319u * 7680u;
  EXPECT_EQ(glm::vec3(image.pixels[right]), glm::vec3(kBlue));  // x = 0, y = 8
  EXPECT_EQ(glm::vec3(image.pixels[0]), glm::vec3(kWhite));
  EXPECT_EQ(glm::vec3(image.pixels[bottom + right]), glm::vec3(kRed));
  EXPECT_EQ(glm::vec3(image.pixels[bottom]), glm::vec3(kGreen));
}

TEST(Picture, OfABrightVoxelAtTheBorderIsDarkOnTheOppositeSide) {
  const int n = 8;
  for (const glm::ivec3 bright : {glm::ivec3(0, 0, 0), glm::ivec3(7, 0, 7), glm::ivec3(0, 7, 3),
                                  glm::ivec3(7, 7, 0), glm::ivec3(7, 4, 4), glm::ivec3(3, 0, 7)})
    for (int axis = 0; axis < 3;
         ++axis) {  // views along each axis, so that wrapping around any axis is detected
      const auto value = [&](int x, int y, int z) { return glm::ivec3(x, y, z) == bright ? 255 : 0; };
      const auto volume = volumeOf(gridOf(glm::ivec3(n)), channelOf<std::uint8_t>(glm::ivec3(n), value));
      Scene scene = frontScene(*volume, 16, 16);
      glm::dvec3 forward(0), up(0);
      forward[axis] = 1;
      up[(axis + 1) % 3] = 1;
      scene.camera.eye = scene.camera.target - 20.0 * forward;
      scene.camera.up = up;
      scene.channels[0] = ramp(0, 255, 1e3);
      const glm::dvec3 right =
          glm::dvec3(forward.y * up.z - forward.z * up.y, forward.z * up.x - forward.x * up.z,
                     forward.x * up.y - forward.y * up.x);
      for (const Method method : kTrackers) {
        const Image image = renderAnalog(volume, scene, method, 1);
        for (int pixel = 0; pixel < 16 * 16; ++pixel) {
          // Distance of the pixel's nearest point from the voxel's centre, perpendicular to the view.
          double nearest = 0;
          const glm::dvec3 centre =
              (double(pixel % 16) - 7.5) * 0.5 * right + (7.5 - double(pixel / 16)) * 0.5 * up + 3.5;
          for (int a = 0; a < 3; ++a)
            if (a != axis) nearest = std::max(nearest, std::abs(centre[a] - bright[a]) - 0.25);
          const float alpha = image.pixels[std::size_t(pixel)].a;
          ASSERT_TRUE(nearest < 1 || alpha == 0) << "axis " << axis << " pixel " << pixel;
          // At most half a voxel away: an optical thickness of at least 1000 * 1/4 * 1/2, at faces and
          // inside.
          ASSERT_TRUE(nearest > 0 || alpha == 1) << "axis " << axis << " pixel " << pixel;
        }
      }
    }
}

TEST(Picture, HasOnlyColoursOfThePalette) {
  const glm::ivec3 dims(9, 9, 9);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, lumps(0)),
                               channelOf<float>(dims, lumps(1)), channelOf<float>(dims, lumps(2)));
  Scene scene = viewFrom(*volume, {20, 15, -9}, {4, 4, 4}, 35, 48);
  scene.channels = {ramp(0, 1, 0.5, {0.2, 0.4, 0.6}), ramp(0, 1, 0.5, {0.9, 0.1, 0.3}), ramp(0, 1, 0.3)};
  scene.channels[2].color = {{0, {0, 0.5, 0}}, {1, {1, 0.5, 0}}};  // red varies, green and blue do not
  scene.sampling = Sampling::independent;
  for (const Method method : kTrackers) {
    scene.method = method;
    const auto renderer = makeCpuRenderer(volume, 0);
    renderer->setScene(scene);
    renderer->renderSample(false);  // one sample with any SCOLOPAX_STATISTICS
    int seen[4] = {};
    for (const glm::vec4& p : renderer->image().pixels) {
      if (p == glm::vec4(0))
        ++seen[3];
      else if (p == glm::vec4(0.2f, 0.4f, 0.6f, 1))
        ++seen[0];
      else if (p == glm::vec4(0.9f, 0.1f, 0.3f, 1))
        ++seen[1];
      else if (p.g == 0.5f && p.b == 0 && p.r >= 0 && p.r <= 1 && p.a == 1)
        ++seen[2];
      else
        FAIL() << "colour " << p.r << " " << p.g << " " << p.b << " " << p.a;
    }
    for (const int count : seen) EXPECT_GT(count, 20);
  }
}

TEST(Picture, OfNothingIsExactlyTransparent) {
  const glm::ivec3 dims(5, 6, 7);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int) { return 0; }),
                               channelOf<float>(dims, [](int, int, int) { return kNaN; }),
                               channelOf<std::uint8_t>(dims, lumps()));
  Scene scene = frontScene(*volume, 16, 16);
  scene.channels = {ramp(0, 1, 1e6), solid(1e6), solid(1e6)};
  scene.channels[2].visible = false;
  for (const Method method : kTrackers) {
    EXPECT_EQ(largestAlpha(renderAnalog(volume, scene, method, 4)), 0);
    EXPECT_EQ(statsOf(volume, scene, method, 1).fetches, 0u);
  }
}

TEST(Picture, IsNotTouchedByAChannelWithoutAFiniteVoxel) {
  const glm::ivec3 dims(9, 8, 7);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    const auto broken = [&](int, int, int) { return bad; };
    const auto good = volumeOf(gridOf(dims), channelOf<float>(dims, lumps()));
    const auto both = volumeOf(gridOf(dims), channelOf<float>(dims, broken), channelOf<float>(dims, lumps()));
    Scene one = viewFrom(*good, {20, 15, -9}, {4, 4, 4}, 35, 40),
          two = viewFrom(*both, {20, 15, -9}, {4, 4, 4}, 35, 40);
    one.channels = {ramp(0, 1, 0.5, kRed)};
    two.channels = {solid(5, kBlue), ramp(0, 1, 0.5, kRed)};
    for (const Method method : kTrackers) {
      const Image image = renderAnalog(good, one, method, 4);
      EXPECT_EQ(largestAlpha(image), 1);
      EXPECT_TRUE(sameBits(image, renderAnalog(both, two, method, 4)));
    }
  }
}

TEST(Picture, OfThirtyTwoChannelsWithAllButOneHiddenIsThatOneAlone) {
  const glm::ivec3 dims(7, 7, 7);
  std::vector<ChannelSource> sources, last;
  for (int n = 0; n < 32; ++n) sources.push_back(channelOf<float>(dims, lumps(n)));
  last.push_back(channelOf<float>(dims, lumps(17)));
  const auto many = std::make_shared<const Volume>(gridOf(dims), std::move(sources));
  const auto alone = std::make_shared<const Volume>(gridOf(dims), std::move(last));
  Scene one = viewFrom(*alone, {20, 15, -9}, {3, 3, 3}, 35, 40),
        all = viewFrom(*many, {20, 15, -9}, {3, 3, 3}, 35, 40);
  one.channels = {ramp(0, 1, 0.5, kRed)};
  for (auto& channel : all.channels) channel.visible = false;
  all.channels[17] = one.channels[0];
  for (const Method method : kTrackers)
    EXPECT_TRUE(sameBits(renderAnalog(alone, one, method, 4), renderAnalog(many, all, method, 4)));
}

TEST(Picture, ThickerThanCanBeTrackedEndsAndSaysSo) {
  // A spike of extinction 1e30 that no ray hits: the bound is 1e30, and every collision is null.
  const glm::ivec3 dims(2, 2, 4);
  const auto value = [](int, int, int z) { return z < 2 ? 0 : 1; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, value));
  Scene scene = frontScene(*volume, 2, 2);
  scene.channels[0] = solid(1e30);
  scene.channels[0].opacity = {{0, 0}, {0.5 - 1e-7, 0}, {0.5, 1}, {0.5 + 1e-7, 0}, {1, 0}};
  for (const Method method : kTrackers) {
    const RenderStats stats = statsOf(volume, scene, method, 2);
    EXPECT_EQ(stats.rays, 8u);
    EXPECT_EQ(stats.truncatedRays, 8u);
    // The limit plus the fetches before the ray used bounds of stretches.
    EXPECT_LE(stats.fetches, 8u * (kernel::kMaxTentativeCollisions + 2 * kernel::kPatience));
  }
  scene.channels[0].opacity = {{0, 1}};  // as thick, but without null collisions
  for (const Method method : kTrackers) {
    EXPECT_EQ(statsOf(volume, scene, method, 2).truncatedRays, 0u);
    EXPECT_EQ(largestAlpha(renderAnalog(volume, scene, method, 2)), 1);
  }
}

TEST(Picture, OfACameraThatIsNotFiniteIsRefused) {
  const glm::ivec3 dims(3, 3, 3);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, lumps()));
  const auto renderer = makeCpuRenderer(volume, 1);
  const Scene good = viewFrom(*volume, {9, 5, -9}, {1, 1, 1}, 35, 8);
  renderer->setScene(good);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (int axis = 0; axis < 3; ++axis)
      for (glm::dvec3 Camera::*vector : {&Camera::eye, &Camera::target, &Camera::up}) {
        Scene scene = good;
        (scene.camera.*vector)[axis] = bad;
        EXPECT_THROW(renderer->setScene(scene), Error) << bad << " axis " << axis;
      }
    Scene scene = good;
    scene.camera.fovY = bad;
    EXPECT_THROW(renderer->setScene(scene), Error) << bad;
    scene.camera.fovY = 35;
    scene.camera.orthoHeight = bad;
    EXPECT_THROW(renderer->setScene(scene), Error) << bad;
  }
  for (const double angle : {0.0, -35.0, 180.0}) {
    Scene scene = good;
    scene.camera.fovY = angle;
    EXPECT_THROW(renderer->setScene(scene), Error) << angle;
  }
  for (const double height : {0.0, -1.0}) {
    Scene scene = good;
    scene.camera.orthoHeight = height;
    EXPECT_THROW(renderer->setScene(scene), Error) << height;
  }
}

}  // namespace
}  // namespace scolopax
