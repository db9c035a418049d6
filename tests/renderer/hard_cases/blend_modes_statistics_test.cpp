// SPDX-License-Identifier: Apache-2.0
// Hard cases of max, mix and composite without light: equal channels, many, weights of 0, thickness, voxels
// that are not finite.
#include <gtest/gtest.h>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/agreement.h"

namespace scolopax {
namespace {

using namespace test;

class EveryBlendMode : public testing::TestWithParam<BlendMode> {
 protected:
  void expectMatches(const std::shared_ptr<const Volume>& volume, Scene scene) {
    scene.blend = GetParam();
    expectUnbiased(volume, scene);
  }
};
INSTANTIATE_TEST_SUITE_P(BlendModes, EveryBlendMode, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

TEST_P(EveryBlendMode, OfOneTwelveAndThirtyTwoChannelsMatchesTheReference) {
  for (const int count : {1, 12, 32}) {
    std::vector<ChannelSource> sources;
    for (int n = 0; n < count; ++n) sources.push_back(channelOf<float>(kSmallDims, lumps(n)));
    const auto volume = std::make_shared<const Volume>(gridOf(kSmallDims), std::move(sources));
    Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, 10);
    for (int n = 0; n < count; ++n) {
      scene.channels[std::size_t(n)] = ramp(0.1, 1, 0.5, glm::dvec3(n % 3 == 0, n % 3 == 1, n % 3 == 2));
      scene.channels[std::size_t(n)].weight = n % 4 == 3 ? 0 : 1.0 / count;
    }
    SCOPED_TRACE(count);
    expectMatches(volume, scene);
  }
}

TEST_P(EveryBlendMode, OfVoxelsThatAreNotFiniteMatchesTheReference) {
  // In one channel only: the others continue there.
  for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY)}) {
    const auto holed = [&](int x, int y, int z) {
      return (x == 3 && y == 2) || (x == 0 && y == 5 && z == 4) ? bad : lumps()(x, y, z);
    };
    const auto volume = volumeOf(gridOf(kSmallDims), channelOf<float>(kSmallDims, holed),
                                 channelOf<float>(kSmallDims, lumps(2)));
    Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, 10);
    scene.channels = {ramp(0, 1, 0.5, kRed), ramp(0, 1, 0.3, kBlue)};
    expectMatches(volume, scene);
  }
}

TEST_P(EveryBlendMode, OfStepsBoxesAndSpikesMatchesTheReference) {
  const auto volume = volumeOf(
      gridOf(kSmallDims), channelOf<float>(kSmallDims, lumps(0)),
      channelOf<std::uint8_t>(kSmallDims, [](int x, int y, int z) { return 255 * lumps(2)(x, y, z); }));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, 10);
  scene.channels = {ramp(0, 1, 0.8, kRed), ramp(0, 255, 0.6, kBlue)};
  scene.channels[0].opacity = {{0, 0}, {0.3, 0}, {0.3, 1}, {0.4, 1}, {0.4, 0.1}, {1, 0}};
  scene.channels[1].opacity = {{0, 0.02}, {0.5, 0.02}, {0.51, 1}, {0.52, 0.02}, {0.8, 0.02}, {0.8, 1}};
  for (const int macrocell : {1, 4, 64}) {
    scene.macrocell = macrocell;
    expectMatches(volume, scene);
  }
}

TEST_P(EveryBlendMode, OfOpticalThicknessFromOneThousandthToOneMillionIsKnown) {
  if (statisticsFactor() < 1) GTEST_SKIP() << "needs its samples";
  // Two channels with the same extinction everywhere. Density: both share the light; max: only the first is
  // seen; mix: both, weighted, with the optical thickness of one; composite: each by itself.
  const glm::ivec3 dims(2, 2, 5);
  const auto one = [](int, int, int) { return 1; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, one), channelOf<float>(dims, one));
  for (const double depth : {1e-3, 0.1, 1.0, 10.0, 1e3, 1e6}) {
    Scene scene = frontScene(*volume, 8, 8);
    scene.blend = GetParam();
    scene.channels = {solid(depth / 5, kRed), solid(depth / 5, kBlue)};
    scene.channels[1].weight = 0.25;
    const double single = -std::expm1(-depth), both = -std::expm1(-2 * depth);
    glm::dvec4 expected(single, 0, 0, single);  // max
    if (scene.blend == BlendMode::density) expected = {both / 2, 0, both / 2, both};
    if (scene.blend == BlendMode::mix) expected = {single, 0, 0.25 * single, single};
    if (scene.blend == BlendMode::composite) expected = {single, 0, single, both};
    for (const Method method : kTrackers)
      EXPECT_TRUE(haveMean(replicate(volume, scene, method), scene, flat(scene, expected)))
          << nameOf(method) << " depth " << depth;
  }
}

TEST_P(EveryBlendMode, OfAnOpaqueChannelInFrontOfAndBehindThinOnesMatchesTheReference) {
  for (const bool front : {false, true}) {
    std::vector<ChannelSource> sources;
    for (int n = 0; n < 6; ++n)
      sources.push_back(
          channelOf<float>({4, 4, 8}, [&](int, int, int z) { return n != 2 || (z < 4) == front; }));
    const auto volume = std::make_shared<const Volume>(gridOf({4, 4, 8}), std::move(sources));
    Scene scene = frontScene(*volume, 8, 8);
    scene.macrocell = 1;
    for (auto& channel : scene.channels) channel = ramp(0, 1, 0.05, kRed);
    scene.channels[2] = ramp(0, 1, 50, kBlue);
    scene.channels[2].opacity = {{0, 0}, {0.5, 0}, {0.5, 1}, {1, 1}};
    expectMatches(volume, scene);
  }
}

}  // namespace
}  // namespace scolopax
