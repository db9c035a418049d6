// SPDX-License-Identifier: Apache-2.0
// Hard cases of the ray marcher. Its quadrature is exact at any step and jitter in a homogeneous box and, for
// any curve, where the scalar is linear.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

Image march(const std::shared_ptr<const Volume>& volume, Scene scene, int samples) {
  return renderAnalog(volume, std::move(scene), Method::raymarch, samples);
}

TEST(RayMarch, OfABoxHidesOneMinusExpOfItsThicknessFromOneMillionthToOneMillion) {
  const glm::ivec3 dims(3, 3, 8);
  const auto one = [](int, int, int) { return 1; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, one), channelOf<float>(dims, one));
  for (const BlendMode blend : kBlends)
    for (const double thickness : {1e-6, 1e-5, 1e-3, 0.1, 1.0, 5.0, 100.0, 1e3, 1e6}) {
      Scene scene = frontScene(*volume, 8, 8);
      scene.blend = blend;
      scene.channels = {solid(thickness / 8, kRed), solid(thickness / 8, kBlue)};
      const bool both = blend == BlendMode::density || blend == BlendMode::composite;
      const double alpha = -std::expm1(-(both ? 2 : 1) * thickness);
      const double red = blend == BlendMode::density ? alpha / 2 : -std::expm1(-thickness);
      // The marcher stops where transmittance falls below 1e-4.
      const double tolerance = (both ? 2 : 1) * thickness > 9 ? 1e-4 : 1e-5;
      for (const glm::vec4& pixel : march(volume, scene, 4).pixels) {
        ASSERT_NEAR(double(pixel.a) / alpha, 1, tolerance) << nameOf(blend) << ' ' << thickness;
        ASSERT_NEAR(double(pixel.r) / red, 1, tolerance) << nameOf(blend) << ' ' << thickness;
      }
    }
}

TEST(RayMarch, OfASpikeNarrowerThanAStepHidesWhatIsInIt) {
  const int n = 65;
  const glm::ivec3 dims(2, 2, n);
  const auto ramps = [](int, int, int z) { return z; };
  const auto volume =
      volumeOf(gridOf(dims), channelOf<float>(dims, ramps), channelOf<std::uint8_t>(dims, ramps));
  for (const BlendMode blend : kBlends)
    for (const double width : {1e-2, 1e-5})  // of the range, 64 voxels
      for (const double depth : {1e-3, 1.0, 20.0})
        for (const double step : {0.5, 3.0}) {
          Scene scene = frontScene(*volume, 8, 8);
          scene.blend = blend;
          scene.macrocell = 1;
          scene.step = step;
          scene.channels[0] = ramp(0, n - 1, depth / (0.5 * width * (n - 1)), kRed);
          scene.channels[0].opacity = {{0.4 - width / 2, 0}, {0.4, 1}, {0.4 + width / 2, 0}};
          scene.channels[1] = solid(0, kBlue);
          // Positions on the curve are floats: a width of 1e-5 is accurate to 0.5 %.
          const double tolerance = width < 1e-3 ? 6e-3 : 1e-4;
          for (const glm::vec4& pixel : march(volume, scene, 4).pixels)
            ASSERT_NEAR(double(pixel.a) / -std::expm1(-depth), 1, tolerance)
                << nameOf(blend) << " width " << width << " depth " << depth << " step " << step;
        }
}

TEST(RayMarch, PassesFromOneChannelToAnotherWhereTheirExtinctionsAreEqual) {
  // One rises and the other falls. Both are linear, and so is the visible extinction on either side of the
  // middle.
  const glm::ivec3 dims(3, 3, 8);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int z) { return z; }),
                               channelOf<float>(dims, [](int, int, int z) { return 7 - z; }));
  for (const double step : {0.0, 0.3, 1.0, 3.0, 20.0})
    for (const BlendMode blend : {BlendMode::max, BlendMode::mix}) {
      Scene scene = frontScene(*volume, 8, 8);
      scene.blend = blend;
      scene.step = step;
      scene.crop = Crop{{-0.5, -0.5, 0}, {2.5, 2.5, 7}};
      constexpr double kDensity = 1e-4;  // of which at most 5.3e-4 hides other matter
      scene.channels = {ramp(0, 7, kDensity, kRed), ramp(0, 7, kDensity, kBlue)};
      const double largest = 7 * 0.75 * kDensity, own = 7 * 0.5 * kDensity;
      for (const glm::vec4& pixel : march(volume, scene, 4).pixels) {
        ASSERT_NEAR(double(pixel.a) / -std::expm1(-largest), 1, 1e-5) << nameOf(blend) << ' ' << step;
        const double red = blend == BlendMode::max ? largest / 2 : own;
        ASSERT_NEAR(double(pixel.r) / red, 1, 5.3e-4) << nameOf(blend) << ' ' << step;
      }
    }
}

TEST(RayMarch, OfMoreStepsThanAFloatCanCountEnds) {
  // 1:1:100 and the finest step: 2e7 steps along the box, which is empty except at its far end.
  const glm::ivec3 dims(2, 2, 2000);
  const auto volume = volumeOf(gridOf(dims, {1, 1, 100}),
                               channelOf<std::uint8_t>(dims, [](int, int, int z) { return z > 1990; }));
  Scene scene = frontScene(*volume, 2, 2);
  scene.method = Method::raymarch;
  scene.step = 0.01;
  scene.channels[0] = solid(1);
  scene.channels[0].opacity = {{0, 0}, {1, 1}};
  const RenderStats stats = statsOf(volume, scene, Method::raymarch, 2);
  EXPECT_LE(stats.fetches, stats.rays << 20);
  for (const glm::vec4& pixel : march(volume, scene, 2).pixels) EXPECT_NEAR(pixel.a, 1, 1e-3);
}

TEST(RayMarch, OfVoxelsThatAreNotFiniteIsFinite) {
  const glm::ivec3 dims(7, 6, 5);
  const float kinds[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e-45f};
  std::uint32_t state = 5;
  const auto value = [&](int, int, int) {
    state = state * 1664525u + 1013904223u;
    return (state >> 20) % 16 ? float(state >> 8) * 0x1p-24f : kinds[(state >> 24) % 6];
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, value), channelOf<float>(dims, value));
  for (const BlendMode blend : kBlends) {
    Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, 16);
    scene.blend = blend;
    scene.shading = scene.shadows = true;
    scene.channels = {ramp(0, 1, 0.5, kRed), ramp(0, 2, 0.5, kBlue)};
    scene.filter = PixelFilter::point;
    const auto expected = reference::renderReference(*volume, scene, 1).image;
    for (const double step : {0.1, 0.025}) {
      scene.step = step;
      const Image found = march(volume, scene, 16);
      // Rays enter and leave some gaps, each within a step of where they should, in matter of extinction 0.5.
      for (std::size_t i = 0; i < found.pixels.size(); ++i)
        for (int c = 0; c < 4; ++c)
          ASSERT_NEAR(found.pixels[i][c], expected.pixels[i][c], 0.5 * step)
              << nameOf(blend) << " pixel " << i << " step " << step;
    }
  }
}

TEST(RayMarch, EndsWhereStepsAreTooManyToCount) {
  // The step is the smallest spacing; along z there are 10^10 steps, through empty space.
  const glm::ivec3 dims(8, 8, 32);
  const auto volume =
      volumeOf(gridOf(dims, {1, 1, 1e8}),
               channelOf<std::uint8_t>(dims, [](int, int y, int z) { return y < 4 && z % 8 < 6 ? 0 : 200; }));
  Scene scene = frontScene(*volume, 4, 4);
  scene.channels = {ramp(0, 255, 1e-12)};
  scene.step = 0.5;
  scene.filter = PixelFilter::point;
  const RenderStats stats = statsOf(volume, scene, Method::raymarch, 1);
  EXPECT_EQ(stats.rays, 16u);
  EXPECT_EQ(stats.truncatedRays, 16u);
}

}  // namespace
}  // namespace scolopax
