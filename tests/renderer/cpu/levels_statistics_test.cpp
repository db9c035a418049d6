// SPDX-License-Identifier: Apache-2.0
// Multi-level quadrature must have the reference's mean, from a coarse base step, in every scene, blend mode
// and light: every pair of settings or, with SCOLOPAX_COMBINATIONS=all, all combinations.
#include <gtest/gtest.h>

#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

/// Bias that remains at the finest resolution.
constexpr double kBiasLeft = 2e-5;

/// The levels that the renderer chooses.
Method quadratureOf(const Scene& scene) { return scene.shadows ? Method::hybrid : Method::raymarch; }
/// Steps of 4 and 1, then voxel cells, whole and in parts of a half and a sixteenth: the bias of halves, up
/// to 5e-4 in these scenes, is of second order, and 64 times that of sixteenths.
const std::vector<int> kPath{3, 5, kEqualSteps, kEqualSteps + 2, kEqualSteps + 5};

class Levels : public testing::TestWithParam<int> {};

TEST_P(Levels, HaveTheMeanOfTheReference) {
  const auto made = testScene(kTestScenes[GetParam()]);
  if (!made) GTEST_SKIP() << "the data set is absent from " << SCOLOPAX_DATA_DIR;
  for (const Setting& setting : allCombinations() ? allSettings() : pairwiseSettings()) {
    if (setting.scene != GetParam()) continue;
    const Scene scene = withSetting(made->scene, setting.blend, setting.light);
    SCOPED_TRACE(testing::Message() << nameOf(scene.blend) << ' '
                                    << kLightConfigurations[setting.light].name);
    auto expected = reference::renderReference(*made->volume, scene, 1);
    const auto found = replicateLevels(made->volume, scene, quadratureOf(scene), kPath);
    EXPECT_TRUE(haveMeanBySpread(found, scene, expected, expected.maximumRayError + kBiasLeft));
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Levels, testing::Range(0, int(std::size(kTestScenes))),
                         [](const auto& tested) { return std::string(kTestSceneNames[tested.param]); });

TEST(LevelsDefect, OfALevelThatIsMissingIsFound) {
  const VolumeAndScene made = *testScene(TestScene::noise);
  const Scene scene = withSetting(made.scene, 0, 0);
  const auto expected = reference::renderReference(*made.volume, scene, 1);
  const double slack = expected.maximumRayError + kBiasLeft;
  for (std::size_t level = 0; level < 2; ++level)
    EXPECT_FALSE(haveMeanBySpread(replicateLevels(made.volume, scene, Method::raymarch, kPath, level), scene,
                                  expected, slack))
        << level;
}

}  // namespace
}  // namespace scolopax
