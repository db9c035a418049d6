// SPDX-License-Identifier: Apache-2.0
// The cost of thick macrocells for a tracker, in counts: it depends on the front at which a ray ends, not on
// the empty space next to it.
#include <gtest/gtest.h>

#include "tests/renderer/hard_cases/hard_scenes.h"

namespace scolopax {
namespace {

using namespace test;

/// Two balls of 8-bit values that fall to 0 outside, at different places.
std::shared_ptr<const Volume> balls() {
  const glm::ivec3 dims(20);
  const auto ball = [](double centre) {
    return [centre](int x, int y, int z) {
      return std::max(0.0, 255 - 40 * glm::length(glm::dvec3(x, y, z) - centre));
    };
  };
  return volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, ball(8)),
                  channelOf<std::uint8_t>(dims, ball(11.3)));
}

class ThickCells : public testing::TestWithParam<BlendMode> {
 protected:
  ThickCells() : volume_(balls()), scene_(viewFrom(*volume_, {-12, -9, -30}, {9.5, 9.5, 9.5}, 40, 24)) {
    scene_.blend = GetParam();
    for (ChannelAppearance& channel : scene_.channels) channel.rangeHi = 255;
  }
  double fetchesPerRay(Method method, double density) {
    for (ChannelAppearance& channel : scene_.channels) channel.density = density;
    const RenderStats stats = statsOf(volume_, scene_, method, 4);
    EXPECT_EQ(stats.truncatedRays, 0u) << nameOf(method);
    return double(stats.fetches) / double(stats.rays);
  }

  std::shared_ptr<const Volume> volume_;
  Scene scene_;
};
INSTANTIATE_TEST_SUITE_P(BlendModes, ThickCells, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

TEST_P(ThickCells, CostNoMoreWithAHundredTimesTheDensity) {
  // With one bound per macrocell, the null collisions before a front are proportional to the bound; with
  // stretches of a ray, the cost grows with its logarithm.
  for (const bool shadows : {false, true})
    for (const Method method : kTrackers) {
      scene_.shadows = shadows;
      EXPECT_LT(fetchesPerRay(method, 1e6), 1.5 * fetchesPerRay(method, 1e4) + 10)
          << nameOf(method) << " shadows " << shadows;
      EXPECT_LT(fetchesPerRay(method, 1e6), 300) << nameOf(method) << " shadows " << shadows;
    }
}

TEST_P(ThickCells, CostNothingWhereTheirBoundIsTight) {
  for (ChannelAppearance& channel : scene_.channels) channel.opacity = {{0, 1}};
  for (const Method method : kTrackers) {
    const double thin = fetchesPerRay(method, 100);
    EXPECT_LE(fetchesPerRay(method, 1e6), thin * 1.01) << nameOf(method);
  }
}

}  // namespace
}  // namespace scolopax
