// SPDX-License-Identifier: Apache-2.0
// Every tracker against the reference, and against the others, in blend modes, lights and scenes: every pair
// of settings or, with SCOLOPAX_COMBINATIONS=all, all combinations.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

class Estimators : public testing::TestWithParam<int> {};

TEST_P(Estimators, HaveTheMeanOfTheReferenceAndOfEachOther) {
  const auto made = testScene(kTestScenes[GetParam()]);
  if (!made) GTEST_SKIP() << "the data set is absent from " << SCOLOPAX_DATA_DIR;
  for (const Setting& setting : allCombinations() ? allSettings() : pairwiseSettings()) {
    if (setting.scene != GetParam()) continue;
    const Scene scene = withSetting(made->scene, setting.blend, setting.light);
    SCOPED_TRACE(testing::Message() << nameOf(scene.blend) << ' '
                                    << kLightConfigurations[setting.light].name);
    const auto expected = reference::renderReference(*made->volume, scene, 1);
    std::vector<Replicates> found;
    for (const Method method : kTrackers) {
      found.push_back(replicate(made->volume, scene, method));
      EXPECT_TRUE(haveMean(found.back(), scene, expected)) << nameOf(method);
      for (std::size_t other = 0; other + 1 < found.size(); ++other)
        EXPECT_TRUE(haveSameMean(found[other], found.back(), scene))
            << nameOf(kTrackers[other]) << " and " << nameOf(method);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Estimators, testing::Range(0, int(std::size(kTestScenes))),
                         [](const auto& tested) { return std::string(kTestSceneNames[tested.param]); });

TEST(Settings, OfTheQuickTestsHaveEveryPairOfSceneBlendModeAndLight) {
  // Methods are not factors here, because every setting is tested with all of them.
  std::set<std::pair<int, int>> sceneBlend, sceneLight, blendLight;
  for (const Setting& s : pairwiseSettings()) {
    sceneBlend.insert({s.scene, s.blend});
    sceneLight.insert({s.scene, s.light});
    blendLight.insert({s.blend, s.light});
  }
  EXPECT_EQ(sceneBlend.size(), std::size(kTestScenes) * std::size(kBlends));
  EXPECT_EQ(sceneLight.size(), std::size(kTestScenes) * std::size(kLightConfigurations));
  EXPECT_EQ(blendLight.size(), std::size(kBlends) * std::size(kLightConfigurations));
  EXPECT_EQ(std::size(kBlends), std::size(kBlendModes));
}

class PaperFigure3 : public testing::TestWithParam<BlendMode> {};

/// The expected picture in closed form.
reference::ReferenceImage figure3(const Scene& scene) {
  reference::ReferenceImage expected{{scene.width, scene.height, {}}, {}, 0};
  for (int y = 0; y < scene.height; ++y)
    for (int x = 0; x < scene.width; ++x)
      expected.image.pixels.push_back(
          glm::vec4(Figure3::seen(scene.blend, Figure3::origin(scene, x, y), Figure3::direction())));
  return expected;
}

TEST_P(PaperFigure3, HasInTheReferenceItsClosedForm) {
  Scene scene = Figure3::scene();
  scene.blend = GetParam();
  scene.width = 20;
  scene.height = 16;
  const auto expected = figure3(scene), found = reference::renderReference(*Figure3::volume(), scene, 1);
  double largest = 0;
  for (std::size_t i = 0; i < expected.image.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      EXPECT_NEAR(double(found.image.pixels[i][c]), double(expected.image.pixels[i][c]), 5e-7)
          << "pixel " << i << " component " << c;
      largest = std::max(largest, double(expected.image.pixels[i][c]));
    }
  EXPECT_GT(largest, 0.9);
}

TEST_P(PaperFigure3, HasInEveryTrackerItsClosedForm) {
  Scene scene = Figure3::scene();
  scene.blend = GetParam();
  scene.width = 20;
  scene.height = 16;
  const auto expected = figure3(scene);
  for (const Method method : kTrackers)
    EXPECT_TRUE(haveMean(replicate(Figure3::volume(), scene, method), scene, expected)) << nameOf(method);
}

INSTANTIATE_TEST_SUITE_P(BlendModes, PaperFigure3, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

}  // namespace
}  // namespace scolopax
