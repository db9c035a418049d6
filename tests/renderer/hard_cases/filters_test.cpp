// SPDX-License-Identifier: Apache-2.0
// Interpolation by the cubic B-spline and by the nearest voxel, in cases without noise.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

void interpolateAll(Scene& scene, Interpolation interpolation) {
  for (ChannelAppearance& channel : scene.channels) channel.interpolation = interpolation;
}

TEST(Filters, OfTheNearestVoxelAreExactAtAnyStep) {
  for (const TestScene which : {TestScene::noise, TestScene::lumps}) {
    const auto made = *testScene(which);
    for (const BlendMode blend : kBlends)
      for (const double step : {0.0, 0.3, 3.0}) {
        Scene scene = thin(made.scene, 0.005);
        interpolateAll(scene, Interpolation::nearest);
        scene.blend = blend;
        EXPECT_LT(largestError(made.volume, scene, step), 2e-5)
            << kTestSceneNames[int(which)] << ' ' << nameOf(blend) << ' ' << step;
      }
  }
}

TEST(Filters, OfTheSplineConvergeInSmallSteps) {
  for (const TestScene which : {TestScene::noise, TestScene::lumps, TestScene::orbitals}) {
    const auto made = *testScene(which);
    Scene scene = thin(made.scene, 0.005);
    interpolateAll(scene, Interpolation::cubic);
    // Voxel cell by voxel cell, the spline of degree 9 is replaced by a cubic.
    EXPECT_LT(largestError(made.volume, scene, 0), 5e-5) << kTestSceneNames[int(which)];
    // Of second order.
    const double ofVoxel = largestError(made.volume, scene, 1, 16);
    EXPECT_LT(largestError(made.volume, scene, 0.1, 16), ofVoxel / 50 + 2e-6) << kTestSceneNames[int(which)];
  }
}

/// A block of ones among zeros, in the middle third.
std::shared_ptr<const Volume> block(glm::ivec3 dims) {
  return volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [dims](int x, int y, int z) {
                    const glm::ivec3 at = 3 * glm::ivec3(x, y, z) / dims;
                    return at == glm::ivec3(1);
                  }));
}

TEST(Filters, OfTheNearestVoxelShowABlockOfVoxels) {
  // Rays along z through the middle of the block pass through three voxels, and nothing else is there.
  const auto volume = block(glm::ivec3(9));
  for (const Method method : kAllMethods) {
    Scene scene = frontScene(*volume, 18, 18);
    scene.filter = PixelFilter::point;
    scene.channels[0] = ramp(0, 1, 0.4, kRed);
    scene.channels[0].interpolation = Interpolation::nearest;
    const Image found = renderAnalog(volume, scene, method, 2048);
    const double alpha = -std::expm1(-0.4 * 3);
    for (int row = 0; row < 18; ++row)
      for (int column = 0; column < 18; ++column) {
        const bool inside = row / 6 == 1 && column / 6 == 1;
        const double value = double(found.pixels[std::size_t(18 * row + column)].a);
        // Trackers: six standard errors.
        const double tolerance = !inside           ? 0
                                 : hasStep(method) ? 1e-6
                                                   : 6 * std::sqrt(0.25 / timesFactor(2048));
        ASSERT_NEAR(value, inside ? alpha : 0, tolerance) << nameOf(method) << ' ' << row << ' ' << column;
      }
  }
}

TEST(Filters, OfTheNearestVoxelKeepLabelsApart) {
  // Labels 0 and 2 are neighbours, and label 1, which has all the opacity, does not occur. Trilinear
  // interpolation would show it between them.
  const glm::ivec3 dims(8);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) {
                                 return (x / 2 + y / 2 + z / 2) % 2 * 2;
                               }));
  for (const Method method : kAllMethods)
    for (const double density : {1.0, 1e6}) {
      Scene scene = frontScene(*volume, 12, 12);
      scene.camera.eye = {30, 20, -40};
      scene.camera.target = {3.5, 3.5, 3.5};
      scene.channels[0] = ramp(0, 2, density, kRed);
      scene.channels[0].opacity = {{0, 0}, {0.2, 0}, {0.2, 1}, {0.8, 1}, {0.8, 0}, {1, 0}};
      scene.shadows = true;
      scene.channels[0].interpolation = Interpolation::nearest;
      for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 8).pixels)
        ASSERT_EQ(pixel, glm::vec4(0)) << nameOf(method);
      scene.channels[0].interpolation = Interpolation::trilinear;
      float most = 0;
      for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 8).pixels)
        most = std::max(most, pixel.a);
      EXPECT_GT(most, 0.4f) << nameOf(method);
    }
}

TEST(Filters, OfDenseVoxelsEndAtTheirFaces) {
  // A voxel's face is opaque at once, and in the empty half cell before it trackers have few collisions.
  const auto volume = block(glm::ivec3(9));
  for (const Interpolation interpolation : {Interpolation::nearest, Interpolation::cubic})
    for (const Method method : {Method::superposed, Method::cumulative, Method::syncDda, Method::nDda}) {
      Scene scene = frontScene(*volume, 18, 18);
      scene.filter = PixelFilter::point;
      scene.channels[0] = ramp(0, 1, 1e6, kRed);
      scene.channels[0].interpolation = interpolation;
      const RenderStats stats = statsOf(volume, scene, method, 2);
      EXPECT_EQ(stats.truncatedRays, 0u) << nameOf(interpolation) << ' ' << nameOf(method);
      EXPECT_LT(double(stats.randomBlocks) / double(stats.rays), 400)
          << nameOf(interpolation) << ' ' << nameOf(method);
    }
}

TEST(Filters, OfTheNearestVoxelHaveSurfacesThatDoNotShadowThemselves) {
  // Shadow rays begin on faces between voxels, and rounding puts some of them on the wrong side.
  const glm::ivec3 dims(6, 5, 7);
  std::uint32_t state = 11;
  const auto volume = volumeOf(gridOf(dims, {1, 2.5, 0.4}), channelOf<std::uint8_t>(dims, [&](int, int, int) {
                                 return (state = state * 1664525u + 1013904223u) >> 30;
                               }));
  for (const bool headlight : {true, false}) {
    Scene scene = viewFrom(*volume, {17, 19, -14}, {2.5, 5, 1.2}, 30, 16);
    scene.filter = PixelFilter::point;
    scene.channels = {ramp(0, 3, 0, kRed)};
    scene.channels[0].isovalues = {{0.5, 0.3, kGreen}, {1.5, 0.5, kBlue}, {2.5, 1, kWhite}};
    scene.channels[0].interpolation = Interpolation::nearest;
    scene.channels[0].material.ambient = 0.1;
    scene.shadows = true;
    if (!headlight) scene.lights = {{LightType::directional, {-0.7, -0.5, 0.6}, kWhite, 1}};
    const auto expected = reference::renderReference(*volume, scene, 1);
    for (const Method method : {Method::raymarch, Method::superposed}) {
      scene.method = method;
      scene.step = 0;
      const Image found = renderSamples(volume, scene, hasStep(method) ? 4 : 4096);
      double squares = 0;
      for (std::size_t i = 0; i < found.pixels.size(); ++i)
        for (int c = 0; c < 4; ++c)
          squares += std::pow(double(found.pixels[i][c]) - double(expected.image.pixels[i][c]), 2);
      // A tracker's samples are at most 1: at most 0.5 / 64 of noise.
      EXPECT_LT(std::sqrt(squares / double(4 * found.pixels.size())), hasStep(method) ? 1e-3 : 0.008)
          << nameOf(method) << " headlight " << headlight;
    }
  }
}

TEST(Filters, OfAConstantFieldChangeNothing) {
  // The spline of equal voxels is their value to the last bit, here at a jump of the curve.
  const glm::ivec3 dims(7, 6, 5);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int) { return 0.3; }));
  for (const Method method : kAllMethods) {
    Scene scene = frontScene(*volume, 9, 9);
    scene.channels[0] = ramp(0, 1, 0.2, kRed);
    const double at = double(0.3f);
    scene.channels[0].opacity = {{0, 0}, {at, 0}, {at, 1}, {1, 1}};
    const Image expected = renderAnalog(volume, scene, method, 4);
    EXPECT_GT(expected.pixels[40].a, 0.1f) << nameOf(method);
    for (const Interpolation interpolation : {Interpolation::cubic, Interpolation::nearest}) {
      interpolateAll(scene, interpolation);
      const Image found = renderAnalog(volume, scene, method, 4);
      for (std::size_t i = 0; i < found.pixels.size(); ++i)
        ASSERT_NEAR(found.pixels[i].a, expected.pixels[i].a, hasStep(method) ? 2e-6 : 0)
            << nameOf(method) << ' ' << nameOf(interpolation);
    }
  }
}

TEST(Filters, LeaveOutWhatReadsVoxelsThatAreNotFinite) {
  const glm::ivec3 dims(9, 8, 7);
  const float kinds[] = {NAN, INFINITY, -INFINITY};
  std::uint32_t state = 5;
  const auto value = [&](int, int, int) {
    state = state * 1664525u + 1013904223u;
    return (state >> 20) % 200 ? float(state >> 8) * 0x1p-24f : kinds[(state >> 24) % 3];
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, value));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {4, 3.5, 3}, 32, 16);
  scene.channels = {ramp(0, 1, 0.05, kRed)};
  for (const Interpolation interpolation : {Interpolation::cubic, Interpolation::nearest}) {
    interpolateAll(scene, interpolation);
    EXPECT_LT(largestError(volume, scene, 0), 1e-4) << nameOf(interpolation);
  }
}

}  // namespace
}  // namespace scolopax
