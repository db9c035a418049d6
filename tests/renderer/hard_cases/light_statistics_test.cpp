// SPDX-License-Identifier: Apache-2.0
// Hard cases with lighting: every tracker, with shading and shadows, against the reference.
#include <gtest/gtest.h>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

constexpr int kLitSide = 8;  // of pictures, in pixels

/// Switches on shading and shadows, with different materials and, unless the scene has lights, both kinds of
/// light.
Scene lit(const Volume& volume, Scene scene) {
  const std::vector<Light> lights = scene.lights;
  furnish(volume.grid(), scene);
  if (!lights.empty()) scene.lights = lights;
  scene.shading = scene.shadows = true;
  scene.filter = PixelFilter::point;
  scene.width = scene.height = kLitSide;
  return scene;
}

void expectMatches(const std::shared_ptr<const Volume>& volume, const Scene& scene) {
  const auto expected = reference::renderReference(*volume, scene, 1);
  double alpha = 0;
  for (const glm::vec4& pixel : expected.image.pixels) alpha += double(pixel.a) / (kLitSide * kLitSide);
  EXPECT_GT(alpha, 0.05) << "there is next to nothing to see";
  for (const Method method : kTrackers)
    EXPECT_TRUE(haveMean(replicate(volume, scene, method), scene, expected)) << nameOf(method);
}

/// Two lumpy channels over a grid; `density` per smallest spacing.
struct LitLumps {
  std::shared_ptr<const Volume> volume;
  Scene scene;
  explicit LitLumps(const Grid& grid, double density = 0.4)
      : volume(volumeOf(grid, channelOf<float>(grid.dims, lumps(0)), channelOf<float>(grid.dims, lumps(3)))) {
    const glm::dvec3 s = grid.spacing();
    density /= std::min({s.x, s.y, s.z});
    scene.camera = framingCamera(grid, 30, 1);
    scene.channels = {ramp(0, 1, density, kRed), ramp(0.2, 0.8, density, kBlue)};
    scene = lit(*volume, scene);
  }
  void expectMatches() const { scolopax::expectMatches(volume, scene); }
};

class LightInEveryBlendMode : public testing::TestWithParam<BlendMode> {};
INSTANTIATE_TEST_SUITE_P(BlendModes, LightInEveryBlendMode, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

TEST_P(LightInEveryBlendMode, OnVoxelsOfEveryKindMatchesTheReference) {
  const float kinds[] = {NAN,  INFINITY, -INFINITY, float(kLargest), -float(kLargest), float(kDenormal),
                         -0.0f};
  std::uint32_t state = 5;
  const auto value = [&](int, int, int) {
    state = state * 1664525u + 1013904223u;
    return (state >> 20) % 32 ? float(state >> 8) * 0x1p-24f : kinds[(state >> 24) % 7];
  };
  const auto volume =
      volumeOf(gridOf(kSmallDims), channelOf<float>(kSmallDims, value), channelOf<float>(kSmallDims, value));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, kLitSide);
  scene.blend = GetParam();
  scene.channels = {ramp(0, 1, 0.3, kGreen), ramp(0, 2, 0.5, kRed)};
  expectMatches(volume, lit(*volume, scene));
}

TEST_P(LightInEveryBlendMode, OnTwelveChannelsMatchesTheReference) {
  std::vector<ChannelSource> sources;
  for (int n = 0; n < 12; ++n)
    sources.push_back(
        channelOf<std::uint8_t>(kSmallDims, [&](int x, int y, int z) { return 255 * lumps(n)(x, y, z); }));
  const auto volume = std::make_shared<const Volume>(gridOf(kSmallDims), std::move(sources));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, kLitSide);
  scene.blend = GetParam();
  scene = lit(*volume, scene);
  scene.lights.resize(1);
  for (std::size_t n = 0; n < 12; ++n) {
    scene.channels[n] = ramp(100, 255, 0.3, glm::dvec3(n % 3 == 0, n % 3 == 1, n % 3 == 2));
    scene.channels[n].weight = n == 5 ? 0 : 0.1;
    scene.channels[n].material = {0.2, 0.6, 0.02 * double(n % 7), 5};
  }
  expectMatches(volume, scene);
}

TEST_P(LightInEveryBlendMode, FromInsideTheVolumeOnAVoxelAndAtTheEyeMatchesTheReference) {
  LitLumps lumpy(gridOf({9, 8, 7}));
  lumpy.scene.blend = GetParam();
  const auto at = [](glm::dvec3 p, glm::dvec3 color) { return Light{LightType::point, p, color, 0.7}; };
  lumpy.scene.lights = {at({4.3, 3.1, 2.6}, kRed), at({4, 4, 4}, kBlue), at({8.5, 4, 4}, {1, 0.5, 0.5}),
                        at(lumpy.scene.camera.eye, {0.5, 0, 1})};
  lumpy.expectMatches();
}

TEST(Light, OnTinyAndHugeRangesOfValuesMatchesTheReference) {
  for (const auto& [lo, hi] :
       {std::pair(0.0, 2000 * kDenormal), std::pair(-1e-38, 1e-38), std::pair(0.0, 1e-25),
        std::pair(-1e25, 1e25), std::pair(-kLargest, kLargest), std::pair(300.0, 299.9)}) {
    const auto value = [a = lo, b = hi](int x, int y, int z) { return a + (b - a) * lumps(1)(x, y, z); };
    const auto volume = volumeOf(gridOf(kSmallDims), channelOf<float>(kSmallDims, value));
    Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, kLitSide);
    scene.channels = {ramp(lo, hi, 0.5, kGreen)};
    SCOPED_TRACE(testing::Message() << lo << " to " << hi);
    expectMatches(volume, lit(*volume, scene));
  }
}

TEST(Light, OnTheFullRangeOfIntegersMatchesTheReference) {
  const auto expectOf = [](auto zero, double lo, double hi) {
    const auto value = [=](int x, int y, int z) { return lo + (hi - lo) * lumps(1)(x, y, z); };
    const auto volume = volumeOf(gridOf(kSmallDims), channelOf<decltype(zero)>(kSmallDims, value));
    Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, kLitSide);
    scene.channels = {ramp(lo, hi, 0.5, kGreen)};
    expectMatches(volume, lit(*volume, scene));
  };
  expectOf(std::uint8_t(0), 0, 255);
  expectOf(std::uint16_t(0), 0, 65535);
  expectOf(std::int16_t(0), -32768, 32767);
}

TEST(Light, OnAStepMatchesTheReference) {
  // lo == hi: every point with a gradient is shaded fully.
  const auto volume = volumeOf(gridOf(kSmallDims), channelOf<float>(kSmallDims, lumps(1)));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, kLitSide);
  scene.channels = {ramp(0.5, 0.5, 0.5, kGreen)};
  expectMatches(volume, lit(*volume, scene));
}

TEST(Light, OnSpacingsOfOneToAHundredMatchesTheReference) {
  for (const glm::dvec3 spacing : {glm::dvec3(1, 1, 100), glm::dvec3(100, 1, 1), glm::dvec3(1, 0.01, 1)}) {
    LitLumps lumpy(gridOf({8, 7, 6}, spacing), 0.12);
    lumpy.scene.camera.target = 3.5 * spacing;
    lumpy.scene.camera.eye = lumpy.scene.camera.target + 500.0 * glm::dvec3(1.2, 0.9, -1.4);
    lumpy.scene.camera.up = {0.1, 1, 0.2};
    lumpy.scene.camera.orthoHeight = 6;  // the middle of the long volume
    for (auto& channel : lumpy.scene.channels) channel.material = {0.1, 0.5, 0.8, 12};
    SCOPED_TRACE(testing::Message() << spacing.x << ' ' << spacing.y << ' ' << spacing.z);
    lumpy.expectMatches();
  }
}

TEST(Light, InWorldsOffsetByAMillionAndScaledByABillionMatchesTheReference) {
  for (const double scale : {1.0, 1e-9, 1e9})
    for (const double offset : {0.0, 1e6}) {
      LitLumps lumpy(gridOf({9, 8, 7}, glm::dvec3(scale), offset * scale * glm::dvec3(1, -1, 1)));
      lumpy.scene.lights.push_back({LightType::headlight, {}, glm::dvec3(1), 0.4});
      SCOPED_TRACE(testing::Message() << "scale " << scale << " offset " << offset);
      lumpy.expectMatches();
    }
}

TEST(Light, FromVeryFarMatchesTheReference) {
  // Point lights up to farther away, in voxels, than the square root of the largest float.
  for (const double far : {1e6, 1e15, 1e20, 1e30}) {
    LitLumps lumpy(gridOf({9, 8, 7}));
    lumpy.scene.lights = {{LightType::point, far * glm::dvec3(0.5, 0.7, -0.3), glm::dvec3(1), 1}};
    SCOPED_TRACE(far);
    lumpy.expectMatches();
  }
}

TEST(Light, OfTheEyeInsideOnAFaceAndInACornerMatchesTheReference) {
  LitLumps lumpy(gridOf({9, 8, 7}));
  lumpy.scene.lights = {{}};  // a headlight
  lumpy.scene.camera.fovY = 80;
  for (const glm::dvec3 eye : {glm::dvec3(4.2, 3.1, 2.7), glm::dvec3(4, 4, 4), glm::dvec3(4.2, 3.1, -0.5),
                               glm::dvec3(-0.5, 7.5, 2.2), glm::dvec3(-0.5, -0.5, -0.5)}) {
    lumpy.scene.camera.eye = eye;
    lumpy.scene.camera.target = eye + glm::dvec3(1, 0.2, 0.7);
    SCOPED_TRACE(testing::Message() << eye.x << ' ' << eye.y << ' ' << eye.z);
    lumpy.expectMatches();
  }
}

TEST(Light, AlongAxesAndFacesOfMacrocellsMatchesTheReference) {
  LitLumps lumpy(gridOf({8, 8, 8}));
  for (const glm::dvec3 to :
       {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1), glm::dvec3(1, 0, -1)}) {
    lumpy.scene.lights = {{LightType::directional, to, glm::dvec3(1), 1}};
    SCOPED_TRACE(testing::Message() << to.x << ' ' << to.y << ' ' << to.z);
    lumpy.expectMatches();
  }
  // Rays and light along the faces between macrocells.
  Scene front = frontScene(*lumpy.volume, 8, 8);
  front.channels = lumpy.scene.channels;
  front.lights = {{LightType::directional, {0, 1, 0}, glm::dvec3(1), 1}};
  expectMatches(lumpy.volume, lit(*lumpy.volume, front));
}

TEST(Light, OfNoIntensityChangesNothing) {
  LitLumps lumpy(gridOf({9, 8, 7}));
  lumpy.scene.lights.push_back({LightType::directional, {0, 0, 1}, glm::dvec3(1), 0});
  lumpy.scene.lights.push_back({LightType::point, {4, 4, 4}, glm::dvec3(0), 1});
  lumpy.expectMatches();
  lumpy.scene.lights.erase(lumpy.scene.lights.begin(), lumpy.scene.lights.begin() + 2);
  lumpy.expectMatches();  // only these lights: no headlight, and no shadow
}

TEST(Shadows, OfABoxAreKnownFromOneThousandthToOneMillion) {
  if (statisticsFactor() < 1) GTEST_SKIP() << "needs its samples";
  // A homogeneous box of thickness d shows (1 - exp(-2 d)) / 2 when lit from the front, d exp(-d) from
  // behind.
  const glm::ivec3 dims(4, 4, 8);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  for (const double depth : {1e-3, 0.1, 1.0, 10.0, 1e3, 1e6})
    for (const double to : {1.0, -1.0}) {
      Scene scene = frontScene(*volume, kLitSide, kLitSide);
      scene.channels[0] = solid(depth / 8);
      scene.channels[0].material = {0.2, 0, 0, 1};
      scene.shadows = true;
      scene.lights = {{LightType::directional, {0, 0, to}, glm::dvec3(1), 1}};
      const double alpha = -std::expm1(-depth);
      const double seen = to > 0 ? -std::expm1(-2 * depth) / 2 : depth * std::exp(-depth);
      const auto expected = flat(scene, glm::dvec4(glm::dvec3(0.2 * alpha + 0.8 * seen), alpha));
      for (const Method method : kTrackers)
        EXPECT_TRUE(haveMean(replicate(volume, scene, method), scene, expected))
            << nameOf(method) << " depth " << depth << " to " << to;
    }
}

}  // namespace
}  // namespace scolopax
