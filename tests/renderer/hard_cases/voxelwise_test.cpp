// SPDX-License-Identifier: Apache-2.0
// Quadrature from one face of voxel cells to the next (step 0): where nothing hides anything within a cell,
// it is exact up to rounding, without any noise.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

TEST(Voxelwise, IsExactInThinMatter) {
  // The part of matter that other matter in the same cell hides is of second order in the density.
  for (const TestScene which : kTestScenes) {
    const auto made = testScene(which);
    if (!made) continue;
    for (const BlendMode blend : {BlendMode::density, BlendMode::composite}) {
      Scene scene = thin(made->scene, 0.005);
      scene.blend = blend;
      EXPECT_LT(largestError(made->volume, scene), 2e-5)
          << kTestSceneNames[int(which)] << ' ' << nameOf(blend);
    }
  }
}

TEST(Voxelwise, IsExactForOneChannelOfOneColor) {
  // Nothing hides matter of another colour, however dense it is.
  for (const TestScene which : kTestScenes) {
    const auto made = testScene(which);
    if (!made) continue;
    for (std::size_t shown = 0; shown < made->scene.channels.size(); ++shown) {
      // The spline is no cubic: Filters.OfTheSplineConvergeInSmallSteps.
      if (made->scene.channels[shown].interpolation == Interpolation::cubic) continue;
      for (const double factor : {1.0, 100.0}) {
        Scene scene = thin(made->scene, factor);
        for (std::size_t i = 0; i < scene.channels.size(); ++i) scene.channels[i].visible = i == shown;
        // Rays end at a transmittance of 1e-4. A gamma bends the curves, which Gauss's rule approximates.
        const double slack = made->scene.channels[shown].gamma == 1 ? 1.2e-4 : 3e-4;
        EXPECT_LT(largestError(made->volume, scene), slack) << kTestSceneNames[int(which)] << ' ' << shown;
      }
    }
  }
}

TEST(Voxelwise, DividesCellsOfDenseMatter) {
  // Cells as thick as 30 times an ordinary scene's hide most of themselves. Whole, they are off by up to 0.3.
  for (const TestScene which : kTestScenes) {
    const auto made = testScene(which);
    if (!made || which == TestScene::figure3) continue;  // whose reference takes long
    for (const BlendMode blend : {BlendMode::density, BlendMode::mix}) {
      Scene scene = made->scene;
      scene.blend = blend;
      scene.width = scene.height = 10;
      for (ChannelAppearance& channel : scene.channels) channel.density *= 30;
      EXPECT_LT(largestError(made->volume, scene), blend == BlendMode::density ? 0.01 : 0.05)
          << kTestSceneNames[int(which)] << ' ' << nameOf(blend);
    }
  }
}

TEST(Voxelwise, DividesFrontsBehindWhichTheColorChanges) {
  // The front of a ramp of extinction is 0.004 voxels deep. Equal steps average all colours of the step that
  // contains it (docs/how-it-works.md).
  const glm::ivec3 dims(8, 8, 8);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int z) { return 32 * z; }));
  Scene scene = frontScene(*volume, 8, 8);
  scene.channels = {ramp(0, 255, 1e6)};
  for (const double change : {1.5e-3, 0.015, 0.06}) {
    scene.channels[0].color = {{0, kRed}, {change, kRed}, {change + 1e-4, kBlue}};
    EXPECT_LT(largestError(volume, scene), 2e-3) << change;
    if (change < 0.01)
      EXPECT_GT(largestError(volume, scene, 0.5), 0.5);
    else
      EXPECT_LT(largestError(volume, scene, 0.02), 1e-4) << change;
    scene.method = Method::automatic;
    const auto renderer = makeCpuRenderer(volume, 0);
    renderer->setScene(scene);
    renderer->renderSample(false);
    const Image first = renderer->image();
    for (const glm::vec4& pixel : first.pixels)
      EXPECT_LT(glm::distance(pixel, glm::vec4(1, 0, 0, 1)), 2e-4) << change;
  }
}

TEST(Voxelwise, LosesNothingWhereCurvesJumpOften) {
  // A staircase of 200 jumps, all of which are passed within one cell; in max and mix, parts end at jumps.
  const glm::ivec3 dims(2, 2, 2);
  const auto along = [](int axis) {
    return [axis](int x, int y, int z) { return axis == 0 ? x : axis == 1 ? y : z; };
  };
  const auto volume =
      volumeOf(gridOf(dims), channelOf<float>(dims, along(2)), channelOf<float>(dims, along(0)));
  Scene scene = frontScene(*volume, 8, 8);
  scene.channels = {ramp(0, 1, 0.5, kRed), ramp(0, 1, 0.3, kBlue)};
  scene.channels[0].opacity.clear();
  for (int i = 0; i <= 200; ++i) {
    const double at = i / 200.0;
    scene.channels[0].opacity.push_back({at, i % 2 ? 0.4 : 0.6});
    scene.channels[0].opacity.push_back({at, i % 2 ? 0.6 : 0.4});
  }
  for (const BlendMode blend : {BlendMode::max, BlendMode::mix}) {
    scene.blend = blend;
    EXPECT_LT(largestError(volume, scene), 0.01) << nameOf(blend);
  }
}

TEST(Voxelwise, SeesPeaksOfAnyWidth) {
  const VolumeAndScene made = *testScene(TestScene::orbitals);
  Scene scene = thin(made.scene, 1);
  for (std::size_t i = 1; i < scene.channels.size(); ++i) scene.channels[i].visible = false;
  ChannelAppearance& channel = scene.channels[0];
  for (const double width : {1e-1, 1e-3, 1e-5}) {
    channel.opacity = {{0.3 - width, 0}, {0.3, 1}, {0.3 + width, 0}};
    channel.density = 0.02 / width;
    // Knots are floats: a width of 1e-5 is accurate to half a percent.
    EXPECT_LT(largestError(made.volume, scene), width < 1e-4 ? 6e-3 : 1e-4) << width;
  }
}

TEST(Voxelwise, LeavesOutWholeCellsWithVoxelsThatAreNotFinite) {
  const glm::ivec3 dims(7, 6, 5);
  const float kinds[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e-45f};
  std::uint32_t state = 5;
  const auto value = [&](int, int, int) {
    state = state * 1664525u + 1013904223u;
    return (state >> 20) % 16 ? float(state >> 8) * 0x1p-24f : kinds[(state >> 24) % 6];
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, value));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, 16);
  scene.channels = {ramp(0, 1, 0.5, kRed)};
  EXPECT_LT(largestError(volume, scene), 1e-4);
}

TEST(Voxelwise, KeepsTheGridsShape) {
  const glm::ivec3 dims(9, 1, 6);
  std::uint32_t state = 9;
  const auto noise = [&](int, int, int) { return (state = state * 1664525u + 1013904223u) >> 24; };
  for (const glm::dvec3 spacing : {glm::dvec3(1), glm::dvec3(1, 1, 100), glm::dvec3(0.01, 3, 1)}) {
    const auto volume = volumeOf(gridOf(dims, spacing), channelOf<std::uint8_t>(dims, noise));
    Scene scene = framed(*volume, 16);
    scene.channels[0].rangeHi = 255;
    scene.channels[0].density = 0.3 / volume->grid().smallestSpacing();
    scene.channels[0].color = {{0, kRed}};
    EXPECT_LT(largestError(volume, scene), 1.2e-4) << spacing.x << ' ' << spacing.z;
  }
}

TEST(Voxelwise, IsExactAtAnyScaleOfValues) {
  const glm::ivec3 dims(6, 7, 5);
  for (const double scale : {1e-24, 1.0, 1e22}) {
    std::uint32_t state = 3;
    const auto noise = [&](int, int, int) {
      return double((state = state * 1664525u + 1013904223u) >> 8) * 0x1p-24 * scale;
    };
    const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, noise));
    Scene scene = framed(*volume, 16);
    scene.channels[0] = ramp(0, scale, 0.5, kRed);
    scene.channels[0].opacity = {{0.4, 0}, {0.5, 1}, {0.6, 0}};
    EXPECT_LT(largestError(volume, scene), 1.2e-4) << scale;
  }
}

TEST(Voxelwise, SplitsAtKnotsOfTheGradientFactor) {
  // Equal steps integrate the factor's curve too: the finest of them agree.
  const VolumeAndScene made = *testScene(TestScene::orbitals);
  Scene scene = thin(made.scene, 0.2);
  for (std::size_t i = 1; i < scene.channels.size(); ++i) scene.channels[i].visible = false;
  ChannelAppearance& channel = scene.channels[0];
  const double most = channel.rangeHi - channel.rangeLo;
  for (const double width : {0.1, 0.01}) {
    channel.gradientOpacity =
        GradientOpacity{0, most, {{0.1 - width, 0}, {0.1, 1}, {0.1 + width, 0}, {1, 0}}};
    scene.method = Method::raymarch;
    scene.step = 0.02;
    const Image expected = renderSamples(made.volume, scene, 4);
    scene.step = 0;
    const Image found = renderSamples(made.volume, scene, 1);
    double largest = 0, seen = 0;
    for (std::size_t i = 0; i < found.pixels.size(); ++i) {
      largest = std::max(largest, std::abs(double(found.pixels[i].a) - double(expected.pixels[i].a)));
      seen = std::max(seen, double(expected.pixels[i].a));
    }
    EXPECT_GT(seen, 1e-3);
    // |gradient| within a cell is assumed to be a cubic, which is an approximation.
    EXPECT_LT(largest, 0.05 * seen) << width;
  }
}

TEST(Voxelwise, LosesNoRayInEmptyCells) {
  // Blobs in empty space, met by rays close to diagonals, where several faces are met at once.
  const glm::ivec3 dims(48, 48, 48);
  const auto blob = [](int x, int y, int z) { return x / 8 % 2 == 0 && y / 8 % 2 == 0 && z / 8 % 2 == 0; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, blob));
  Scene scene = frontScene(*volume, 96, 96);
  scene.channels[0] = solid(1e-4);
  scene.channels[0].opacity = {{0, 0}, {1, 1}};
  scene.method = Method::raymarch;
  scene.step = 0;
  for (const double away : {60.0, 200.0, 5000.0})
    for (const glm::dvec3 from : {glm::dvec3(1, 1, 1), glm::dvec3(1, 1, 0), glm::dvec3(3, 1, 2)}) {
      scene.camera.eye = scene.camera.target + away * from;
      scene.camera.orthoHeight = 60;
      const RenderStats stats = statsOf(volume, scene, Method::raymarch, 1);
      EXPECT_EQ(stats.truncatedRays, 0u) << away << ' ' << from.y << ' ' << from.z;
      // A ray meets at most three faces for every voxel of an edge.
      EXPECT_LT(stats.cellSteps, stats.rays * 3 * 48);
    }
}

}  // namespace
}  // namespace scolopax
