// SPDX-License-Identifier: Apache-2.0
// Opacity by the gradient: every tracker and marcher against closed forms and the reference, where the
// gradient is numerically hard, one-sided or undefined, and in all blend modes and lights.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "renderer/metrics/metrics.h"
#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"
#include "tests/support/gradients.h"

namespace scolopax {
namespace {

using namespace test;

const std::vector<OpacityKnot> kRising{{0, 0}, {1, 1}};

/// Sets opacity by the gradient in every channel, over this part of the channel's gradients.
void setAll(Scene& scene, const Volume& volume, double lowShare, double highShare,
            const std::vector<OpacityKnot>& factor = kRising) {
  for (std::size_t n = 0; n < scene.channels.size(); ++n)
    scene.channels[n].gradientOpacity = factorBetween(volume, n, lowShare, highShare, factor);
}

TEST(GradientThickness, OfARampIsThatOfItsOneGradient) {
  for (const glm::dvec3 spacing : {glm::dvec3(1, 2, 1), glm::dvec3(1, 2, 0.25), glm::dvec3(1, 2, 5)})
    for (const double slope : {1.0, -0.25}) {
      const glm::ivec3 dims(6, 3, 9);
      const auto volume =
          volumeOf(gridOf(dims, spacing), channelOf<std::uint16_t>(
                                              dims, [](int, int, int z) { return 100 + 7 * z; }, slope, 30));
      const double steepness = 7 * std::abs(slope) / spacing.z;
      Scene scene = frontScene(*volume, 8, 8);
      scene.channels = {solid(0.5, kRed)};
      for (const bool reversed : {false, true}) {
        scene.channels[0].gradientOpacity = GradientOpacity{0, 4 * steepness, kRising};  // a quarter
        if (reversed)
          std::swap(scene.channels[0].gradientOpacity->rangeLo, scene.channels[0].gradientOpacity->rangeHi);
        const double depth = 0.5 * (reversed ? 0.75 : 0.25) * 9 * spacing.z;
        expectThickness(volume, scene, depth, kRed, 300);
        expectMarchedThickness(volume, scene, depth, {0.3});
      }
    }
}

TEST(GradientThickness, OfAParabolaIsThePlaceOfTheKnots) {
  // |gradient| of z^2 is 2z, except in the outermost voxels.
  const glm::ivec3 dims(5, 5, 12);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int z) { return z * z; }));
  for (const int macrocell : {1, 4, 16}) {
    Scene scene = frontScene(*volume, 8, 8);
    scene.macrocell = macrocell;
    const auto expectDepth = [&](const GradientOpacity& opacity, double length) {
      scene.channels = {solid(0.4, kGreen)};
      scene.channels[0].gradientOpacity = opacity;
      expectThickness(volume, scene, 0.4 * length, kGreen, 300);
      if (opacity.rangeLo != opacity.rangeHi) expectMarchedThickness(volume, scene, 0.4 * length, {0.3});
    };
    expectDepth({4, 10, kRising}, 1.5 + 6.5);
    expectDepth({10, 4, kRising}, 2.5 + 1.5);
    expectDepth({7, 7, kRising}, 11.5 - 3.5);
    expectDepth({0, 20, {{0, 0}, {0.5, 0}, {0.5, 1}, {0.75, 0.25}}}, 2.5 * 0.625 + 4 * 0.25);
  }
}

TEST(GradientOpacity, OfVolumesThatAreAllBorderMatchesTheReference) {
  int blend = 0;
  for (const glm::ivec3 dims : {glm::ivec3(1), glm::ivec3(2), glm::ivec3(3), glm::ivec3(1, 5, 3),
                                glm::ivec3(2, 1, 7), glm::ivec3(6, 2, 2), glm::ivec3(1, 1, 4)}) {
    SCOPED_TRACE(testing::Message() << dims.x << ' ' << dims.y << ' ' << dims.z);
    const auto volume =
        volumeOf(gridOf(dims, {1, 1.5, 0.7}), channelOf<float>(dims, lumps(0)),
                 channelOf<std::uint8_t>(dims, [](int x, int y, int z) { return 200 * lumps(2)(x, y, z); }));
    const glm::dvec3 centre(volume->grid().worldFromVoxel * glm::dvec4(glm::dvec3(dims - 1) * 0.5, 1));
    Scene scene = viewFrom(*volume, centre + glm::dvec3(4, -5, 9), centre, 50, 12);
    scene.blend = kBlends[blend++ % 4];
    scene.channels = {solid(0.6, kRed), solid(0.8, kBlue)};
    setAll(scene, *volume, 0, 1, {{0, 0.1}, {0.7, 1}, {1, 0.3}});
    expectUnbiased(volume, scene);
  }
}

TEST(GradientOpacity, OfVoxelsThatAreNotFiniteMatchesTheReference) {
  constexpr float kBad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()};
  const glm::ivec3 dims(14, 13, 12);
  const auto holed = [&](int x, int y, int z) {
    const int i = x + 14 * (y + 13 * z);
    return i % 97 == 31 ? kBad[i % 3] : float(lumps()(x, y, z));
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, holed), channelOf<float>(dims, lumps(1)));
  for (const BlendMode blend : kBlends) {
    SCOPED_TRACE(nameOf(blend));
    Scene scene = viewFrom(*volume, {-9, -12, -20}, {6.5, 6, 5.5}, 40, 12);
    scene.blend = blend;
    scene.channels = {ramp(0, 1, 0.8, kRed), ramp(0, 1, 0.4, kBlue)};
    scene.channels[0].gradientOpacity = factorBetween(*volume, 0, 0.1, 0.9);
    expectUnbiased(volume, scene);
  }
}

TEST(GradientOpacity, OfEveryTypeAndSlopeMatchesTheReference) {
  const glm::ivec3 dims(9, 8, 7);
  const auto scaled = [](int kind, double by, double offset = 0) {
    return [=](int x, int y, int z) { return offset + by * lumps(kind)(x, y, z); };
  };
  const auto volume =
      volumeOf(gridOf(dims, {1, 0.6, 1.4}), channelOf<std::uint8_t>(dims, scaled(0, 250), 0.01, -5),
               channelOf<std::int16_t>(dims, scaled(1, 60000, -30000), -2, 300),
               channelOf<std::uint16_t>(dims, scaled(2, 65000), 1e-4),
               channelOf<float>(dims, scaled(3, 1e-20), 1e3, 7e-18));
  Scene scene = viewFrom(*volume, {-7, -9, -12}, {4, 2.1, 4.2}, 45, 12);
  const glm::dvec3 colors[] = {kRed, kGreen, kBlue, kWhite};
  for (std::size_t n = 0; n < 4; ++n) {
    const Histogram& values = volume->channels()[n].histogram;
    scene.channels[n] = ramp(values.minimum, values.maximum, 0.5, colors[n]);
  }
  setAll(scene, *volume, 0.1, 0.8);
  for (const BlendMode blend : kBlends) {
    SCOPED_TRACE(nameOf(blend));
    scene.blend = blend;
    expectUnbiased(volume, scene);
  }
}

TEST(GradientOpacity, OfSmallDifferencesOfLargeValuesMatchesTheReference) {
  // Floats near a million are multiples of 1/16, so interpolated values have rounding errors of a few
  // hundredths.
  const glm::ivec3 dims(10, 9, 8);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int x, int y, int z) {
                                 return 1e6 + std::round(8 * lumps()(x, y, z));
                               }));
  for (const int macrocell : {1, 4}) {
    Scene scene = viewFrom(*volume, {-8, -9, -14}, {4.5, 4, 3.5}, 40, 12);
    scene.macrocell = macrocell;
    scene.channels = {ramp(1e6, 1e6 + 8, 0.5, kRed)};
    scene.channels[0].gradientOpacity = GradientOpacity{0.5, 3, kRising};
    expectReference(volume, scene, 300);
  }
}

/// Two balls of 8-bit values, equal inside and 0 outside.
std::shared_ptr<const Volume> hardBalls() {
  const glm::ivec3 dims(20);
  const auto ball = [](double centre) {
    return [centre](int x, int y, int z) { return glm::length(glm::dvec3(x, y, z) - centre) < 6 ? 200 : 0; };
  };
  return volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, ball(8)),
                  channelOf<std::uint8_t>(dims, ball(11.3)));
}

// Inside, the factor reduces a density of a million to almost nothing; a shell of two voxels is opaque.
TEST(GradientOpacity, OfDenseMatterShowsItsEdgesOnly) {
  const auto volume = hardBalls();
  for (const BlendMode blend : kBlends)
    for (const double inside : {0.0, 1e-7}) {
      SCOPED_TRACE(testing::Message() << nameOf(blend) << ' ' << inside);
      Scene scene = viewFrom(*volume, {-12, -9, -30}, {9.5, 9.5, 9.5}, 40, 8);
      scene.blend = blend;
      const auto fetchesPerRay = [&](Method method, double density) {
        scene.channels = {ramp(0, 200, density, kRed), ramp(0, 200, density, kBlue)};
        for (ChannelAppearance& channel : scene.channels) {
          channel.opacity = {{0, 0}, {0.5, 0}, {0.5, 1}};
          channel.gradientOpacity = GradientOpacity{0, 100, {{0, inside}, {0.6, inside}, {0.6, 1}}};
        }
        const RenderStats stats = statsOf(volume, scene, method, 4);
        EXPECT_EQ(stats.truncatedRays, 0u) << nameOf(method);
        return double(stats.fetches) / double(stats.rays);
      };
      // As in ThickCells, but each test and each stretch has seven times the fetches.
      for (const Method method : kTrackers) {
        const double thin = fetchesPerRay(method, 1e4);
        EXPECT_LT(fetchesPerRay(method, 1e6), 1.5 * thin + 70) << nameOf(method);
      }
      // Only every second pair, unless all are wanted, because the reference is slow.
      if (allCombinations() || (inside == 0) == (blend == BlendMode::density || blend == BlendMode::mix))
        expectUnbiased(volume, scene);
    }
}

TEST(GradientOpacity, OfThirtyTwoChannelsMatchesTheReference) {
  const glm::ivec3 dims(8, 7, 6);
  std::vector<ChannelSource> sources;
  for (int n = 0; n < 32; ++n) sources.push_back(channelOf<float>(dims, lumps(n)));
  const auto volume = std::make_shared<const Volume>(gridOf(dims), std::move(sources));
  Scene scene = viewFrom(*volume, {-7, -9, -12}, {3.5, 3, 2.5}, 40, 8);
  const glm::dvec3 colors[] = {kRed, kGreen, kBlue, kWhite};
  for (std::size_t n = 0; n < 32; ++n) scene.channels[n] = ramp(0, 1, 0.04, colors[n % 4]);
  setAll(scene, *volume, 0.2, 0.8);
  expectReference(volume, scene, 200);
  scene.blend = BlendMode::composite;
  expectUnbiased(volume, scene);
  // The reference looks for handovers among 496 pairs of channels, few of which depend on the gradient.
  scene.blend = BlendMode::max;
  scene.width = scene.height = 5;
  for (std::size_t n = 0; n < 32; ++n)
    if (n != 0 && n != 17 && n != 31) scene.channels[n].gradientOpacity.reset();
  for (ChannelAppearance& channel : scene.channels) channel.density = 0.3;
  expectUnbiased(volume, scene);
}

/// Ways to use opacity by the gradient.
struct Look {
  const char* name;
  std::function<void(Scene&, const Volume&)> apply;
};
const Look kLooks[] = {
    {"Edges", [](Scene& scene, const Volume& volume) { setAll(scene, volume, 0.2, 0.9); }},
    {"WhatIsFlat", [](Scene& scene, const Volume& volume) { setAll(scene, volume, 0.6, 0.05); }},
    {"OneChannel",
     [](Scene& scene, const Volume& volume) {
       scene.channels[0].gradientOpacity = factorBetween(volume, 0, 0.1, 0.7);
     }},
    {"Steps",
     [](Scene& scene, const Volume& volume) {
       for (std::size_t n = 0; n < scene.channels.size(); ++n) {
         const double at = 1.03 * gradientQuantile(volume, n, 0.3 + 0.1 * double(n));
         scene.channels[n].gradientOpacity = GradientOpacity{at, at, kRising};
       }
     }},
    {"JumpsAndPlateaus",
     [](Scene& scene, const Volume& volume) {
       setAll(scene, volume, 0.05, 0.95,
              {{0, 0}, {0.2, 0}, {0.2, 0.7}, {0.5, 0.7}, {0.5, 0.1}, {0.8, 1}, {1, 0.3}});
     }},
    {"ABand",
     [](Scene& scene, const Volume& volume) {
       setAll(scene, volume, 0, 1, {{0.1, 0}, {0.1, 1}, {0.6, 1}, {0.6, 0.05}});
     }},
};

class GradientLooks : public testing::TestWithParam<int> {};

/// Pairs of look and blend mode; lights and scenes alternate.
TEST_P(GradientLooks, AreUnbiased) {
  const Look& look = kLooks[GetParam()];
  for (int blend = 0; blend < int(std::size(kBlends)); ++blend) {
    const int light = (blend + GetParam()) % int(std::size(kLightConfigurations));
    const TestScene which = (blend / 2 + GetParam()) % 2 ? TestScene::noise : TestScene::lumps;
    auto made = *testScene(which);
    made.scene = withSetting(made.scene, blend, light);
    if (made.scene.shadows)
      made.scene.width = made.scene.height = 6;  // for which the reference takes seconds
    look.apply(made.scene, *made.volume);
    SCOPED_TRACE(testing::Message() << kTestSceneNames[int(which)] << ' ' << nameOf(kBlends[blend]) << ' '
                                    << kLightConfigurations[light].name);
    const auto expected = reference::renderReference(*made.volume, made.scene, 1);
    for (const Method method : kTrackers)
      EXPECT_TRUE(haveMean(replicate(made.volume, made.scene, method), made.scene, expected))
          << nameOf(method);
  }
}

TEST_P(GradientLooks, AreWhatQuadratureApproaches) {
  for (const BlendMode blend : kBlends)
    for (const LightConfiguration& light : kLightConfigurations) {
      // The reference takes too long for all looks and, in `make test`, for all blend modes.
      if (light.shadows && (GetParam() > 0 || (blend != BlendMode::max && !allCombinations()))) continue;
      if (!allCombinations() && light.shading != ((int(blend) + GetParam()) % 2 == 0)) continue;
      auto made = *testScene(TestScene::lumps);
      made.scene.width = made.scene.height = light.shadows ? 8 : 16;
      made.scene.blend = blend;
      made.scene.shading = light.shading;
      made.scene.shadows = light.shadows;
      kLooks[GetParam()].apply(made.scene, *made.volume);
      const Image expected = reference::renderReference(*made.volume, made.scene, 1).image;
      for (const Method method : {Method::raymarch, Method::hybrid}) {
        if (method == Method::hybrid && !light.shadows) continue;  // the same as raymarch
        const auto errorAt = [&](double step) {
          made.scene.step = step;
          made.scene.method = method;
          const int samples = method == Method::hybrid ? 1024 : 192;
          return compareImages(renderSamples(made.volume, made.scene, samples), expected).rmse;
        };
        const double coarse = errorAt(1), fine = errorAt(0.1);
        EXPECT_LT(fine, coarse / 3) << nameOf(method) << ' ' << nameOf(blend) << ' ' << light.name;
        EXPECT_LT(fine, 1.5e-3) << nameOf(method) << ' ' << nameOf(blend) << ' ' << light.name;
      }
    }
}

INSTANTIATE_TEST_SUITE_P(Of, GradientLooks, testing::Range(0, int(std::size(kLooks))),
                         [](const auto& tested) { return std::string(kLooks[tested.param].name); });

TEST(GradientOpacity, OfAnisotropicTiltedVolumesMatchesTheReference) {
  const glm::ivec3 dims(9, 7, 8);
  Grid grid = gridOf(dims, {1, 3, 0.4}, {50, -20, 7});
  const glm::dmat4 tilt(glm::dvec4(0.8, 0.6, 0, 0), glm::dvec4(-0.6, 0.8, 0, 0), glm::dvec4(0.1, 0, 1, 0),
                        glm::dvec4(0, 0, 0, 1));
  grid.worldFromVoxel = tilt * grid.worldFromVoxel;
  const auto volume =
      volumeOf(grid, channelOf<float>(dims, lumps(0)),
               channelOf<std::uint16_t>(dims, [](int x, int y, int z) { return 1000 * lumps(2)(x, y, z); }));
  const glm::dvec3 centre(grid.worldFromVoxel * glm::dvec4(glm::dvec3(dims - 1) * 0.5, 1));
  for (const Look& look : kLooks) {
    SCOPED_TRACE(look.name);
    Scene scene = viewFrom(*volume, centre + glm::dvec3(20, -25, 18), centre, 40, 16);
    scene.channels = {ramp(0, 1, 0.4, kRed), ramp(0, 1000, 0.4, kBlue)};
    look.apply(scene, *volume);
    expectReference(volume, scene, 200);
  }
}

}  // namespace
}  // namespace scolopax
