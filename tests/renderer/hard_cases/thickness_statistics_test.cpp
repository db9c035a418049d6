// SPDX-License-Identifier: Apache-2.0
// Optical thickness over twelve decades, and curves with features that quadratures and bounds may miss. The
// volume is a ramp along the rays, so that every thickness has a closed form: the area under the curve.
#include <gtest/gtest.h>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

/// Voxel z holds z; n voxels along the rays, spacing 1.
std::shared_ptr<const Volume> rampAlongZ(int n) {
  const glm::ivec3 dims(2, 2, n);
  return volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int z) { return z; }));
}

TEST(Thickness, OfOneHundredThousandthIsNotAFactorOfTwoOff) {
  // 34 million rays have 340 collisions: 6 sigma are 33 %. draws_test tests the exact law from 1e-6 on
  // without noise.
  const glm::ivec3 dims(4, 4, 16);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  const double thickness = 1e-5, alpha = -std::expm1(-thickness);
  for (const Method method : kTrackers) {
    Scene scene = frontScene(*volume, 128, 128);
    scene.channels[0] = solid(thickness / 16, kRed);
    const Image image = renderAnalog(volume, scene, method, 2048);
    EXPECT_TRUE(isUnbiased(image, 2048, flat(scene, {alpha, 0, 0, alpha}))) << nameOf(method);
  }
}

TEST(Thickness, OfARampHidesItsAreaFromOneThousandthToOneMillion) {
  const int n = 17;
  const auto volume = rampAlongZ(n);
  for (const double thickness : {1e-3, 0.1, 1.0, 10.0, 1e3, 1e6}) {
    const int side = thickness > 100 ? 6 : 24;  // 15 000 null collisions in the empty half voxel before 1e6
    Scene scene = frontScene(*volume, side, side);
    scene.channels[0] = ramp(0, n - 1, thickness / (8 + 0.5), kRed);  // the outer half voxel is 1
    expectThickness(volume, scene, thickness, kRed, thickness > 100 ? 20 : 300);
    for (const Method method : kTrackers) EXPECT_EQ(statsOf(volume, scene, method, 1).truncatedRays, 0u);
  }
}

TEST(Thickness, OfAFallingRampHidesItsAreaAndShowsItsFront) {
  const int n = 17;
  const auto volume = rampAlongZ(n);
  for (const double thickness : {1e-2, 1.0, 1e3}) {
    Scene scene = frontScene(*volume, 24, 24);
    scene.channels[0] = ramp(0, n - 1, thickness / (8 + 0.5), kRed);
    scene.channels[0].opacity = {{0, 1}, {1, 0}};
    expectThickness(volume, scene, thickness, kRed, 300);
  }
  // Tests the place along the ray: red up to the 4th voxel, blue behind.
  Scene scene = frontScene(*volume, 24, 24);
  scene.channels[0] = ramp(0, n - 1, 0.2);
  scene.channels[0].opacity = {{0, 1}, {1, 0}};
  scene.channels[0].color = {{0, kRed}, {0.25, kRed}, {0.25, kBlue}, {1, kBlue}};
  const double front = -std::expm1(-0.2 * (0.5 + 4 * 0.875)), all = -std::expm1(-0.2 * 8.5);
  expectTrackersMatch(flat(scene, {front, 0, all - front, all}), volume, scene, 500);
}

TEST(Thickness, OfASpikeOneHundredThousandthOfTheRangeWideIsItsArea) {
  const int n = 257;
  const auto volume = rampAlongZ(n);
  for (const double centre : {0.5, 0.371234, 0.9}) {
    Scene scene = frontScene(*volume, 16, 16);
    scene.macrocell = 1;
    const double width = 1e-5;
    scene.channels[0] = ramp(0, n - 1, 1 / (0.5 * width * (n - 1)), kGreen);  // thickness 1
    scene.channels[0].opacity = {{centre - width / 2, 0}, {centre, 1}, {centre + width / 2, 0}};
    expectThickness(volume, scene, 1, kGreen, 40);
  }
}

TEST(Thickness, OfSpikesAtBothEndsOfTheRangeIsThatOfTheHalfVoxelsOutside) {
  // The outer half voxels have exactly the values 0 and n - 1; the parts of the spikes on the ramp are
  // negligible.
  const int n = 9;
  const auto volume = rampAlongZ(n);
  Scene scene = frontScene(*volume, 24, 24);
  scene.channels[0] = ramp(0, n - 1, 1, kBlue);
  scene.channels[0].opacity = {{0, 1}, {1e-5, 0}, {1 - 1e-5, 0}, {1, 1}};
  expectThickness(volume, scene, 1 + 8e-5, kBlue, 300);
}

TEST(Thickness, OfBoxesAndStepsIsTheirWidthAtAnyMacrocellSize) {
  // The sharp boxes lie between voxels, inside one macrocell or across two: bounds from voxel values alone
  // are 0 there.
  const int n = 17;
  const auto volume = rampAlongZ(n);
  const std::vector<std::pair<std::vector<OpacityKnot>, double>> curves = {
      {{{0.26, 0}, {0.26, 1}, {0.3, 1}, {0.3, 0}}, 0.04 * 16},
      {{{0.24, 0}, {0.24, 1}, {0.26, 1}, {0.26, 0}}, 0.02 * 16},
      {{{0.5, 0}, {0.5, 1}, {0.51, 1}, {0.51, 0}, {0.9, 0}, {0.9, 0.5}, {0.91, 0.5}, {0.91, 0}}, 0.015 * 16},
      {{{0, 0}, {0.437, 0}, {0.437, 1}, {1, 1}}, 0.563 * 16 + 0.5},
      {{{0, 1}, {0.437, 1}, {0.437, 0}, {1, 0}}, 0.437 * 16 + 0.5},
  };
  for (const auto& [opacity, width] : curves)
    for (const int macrocell : {1, 3, 4, 5, 64}) {
      Scene scene = frontScene(*volume, 16, 16);
      scene.macrocell = macrocell;
      scene.channels[0] = ramp(0, n - 1, 1.5 / width, kRed);
      scene.channels[0].opacity = opacity;
      expectThickness(volume, scene, 1.5, kRed, 100);
    }
}

TEST(Thickness, OfCellsThatTrackersLookAtCloselyIsThatOfTheReference) {
  // Noise in 8-bit voxels, mostly empty: every macrocell contains both dense matter and empty space.
  const glm::ivec3 dims(9, 8, 7);
  std::uint32_t state = 3;
  const auto noise = [&](int, int, int) { return (state = state * 1664525u + 1013904223u) >> 24; };
  const auto volume = volumeOf(gridOf(dims, {1, 1.3, 0.8}), channelOf<std::uint8_t>(dims, noise),
                               channelOf<float>(dims, noise));
  for (const BlendMode blend : kBlends)
    for (const double density : {60.0, 2000.0}) {
      Scene scene = framed(*volume, 8);
      scene.blend = blend;
      scene.shadows = density < 100;
      for (ChannelAppearance& channel : scene.channels) {
        channel.rangeHi = 255;
        channel.density = density;
      }
      scene.channels[0].opacity = {{0, 0}, {0.7, 0}, {1, 1}};
      scene.channels[1].opacity = {{0, 0}, {0.8, 0}, {0.8, 1}, {0.82, 1}, {0.82, 0}};
      const auto expected = reference::renderReference(*volume, scene, 1);
      for (const Method method : kTrackers)
        EXPECT_TRUE(haveMean(replicate(volume, scene, method), scene, expected))
            << nameOf(method) << " " << nameOf(blend) << " " << density;
    }
}

TEST(Thickness, DoesNotDriftInAMillionSamples) {
  const int n = 5;
  const auto volume = rampAlongZ(n);
  Scene scene = frontScene(*volume, 1, 1);
  scene.channels[0] = ramp(0, n - 1, 0.1, kRed);
  const double alpha = -std::expm1(-0.1 * 2.5);
  for (const Method method : kTrackers) {
    const Image image = renderAnalog(volume, scene, method, 1'000'000, 1);
    EXPECT_TRUE(isUnbiased(image, 1'000'000, flat(scene, {alpha, 0, 0, alpha})));
    const double samples = timesFactor(1'000'000);
    const double hits =
        double(image.pixels[0].a) * samples;  // a whole number: no sample is lost or added twice
    EXPECT_NEAR(hits, std::round(hits), samples * 0x1p-25);
    EXPECT_EQ(image.pixels[0].r, image.pixels[0].a);
  }
}

}  // namespace
}  // namespace scolopax
