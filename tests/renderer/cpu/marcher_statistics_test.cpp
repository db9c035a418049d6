// SPDX-License-Identifier: Apache-2.0
// Quadrature must converge to the reference as its step shrinks, lit and unlit, in every blend mode, and its
// error estimate must be right.
#include <gtest/gtest.h>

#include "renderer/engine/step_bias.h"
#include "renderer/metrics/metrics.h"
#include "tests/support/estimator_scenes.h"
#include "tests/support/statistics.h"

namespace scolopax {
namespace {

using namespace test;

class Quadrature : public testing::TestWithParam<std::tuple<Method, BlendMode>> {};

TEST_P(Quadrature, ApproachesTheReferenceAsItsStepShrinks) {
  const auto [volume, framed] = *testScene(TestScene::lumps);
  const auto [method, blend] = GetParam();
  for (const bool lit : {false, true}) {
    Scene scene = framed;
    scene.width = scene.height = 20;
    scene.blend = blend;
    scene.shading = scene.shadows = lit;
    scene.method = method;
    const Image expected = reference::renderReference(*volume, scene, 1).image;
    const auto errorAt = [&](double step) {
      scene.step = step;
      return compareImages(renderSamples(volume, scene, method == Method::hybrid && lit ? 1024 : 96),
                           expected)
          .rmse;
    };
    // The order is 2 where the field is smooth. At voxels' faces it is not, so the overall order is between 1
    // and 2.
    const double coarse = errorAt(2), middle = errorAt(1), fine = errorAt(0.25);
    EXPECT_LT(middle, coarse / 2) << "lit " << lit;
    EXPECT_LT(fine, middle / 4) << "lit " << lit;
    EXPECT_LT(fine, 1e-3) << "lit " << lit;
  }
}

std::string nameOfQuadrature(const testing::TestParamInfo<std::tuple<Method, BlendMode>>& tested) {
  return std::string(nameOf(std::get<0>(tested.param))) + "_" +
         std::string(nameOf(std::get<1>(tested.param)));
}

INSTANTIATE_TEST_SUITE_P(Methods, Quadrature,
                         testing::Combine(testing::Values(Method::raymarch, Method::hybrid),
                                          testing::ValuesIn(kBlends)),
                         nameOfQuadrature);

class Estimates : public testing::TestWithParam<int> {};

TEST_P(Estimates, OfBiasIsThatOfTheReference) {
  const auto made = testScene(kTestScenes[GetParam()]);
  if (!made) GTEST_SKIP() << "the data set is absent from " << SCOLOPAX_DATA_DIR;
  for (const bool lit : {false, true})
    for (const double step : {2.0, 0.5}) {
      Scene scene = made->scene;
      scene.width = scene.height = 24;
      scene.method = Method::raymarch;
      scene.shading = scene.shadows = lit;
      scene.step = step;
      const Image expected = reference::renderReference(*made->volume, scene, 1).image;
      // The common part of two pictures with independent noise.
      const Image one = renderSamples(made->volume, scene, 128);
      scene.seed = 1;
      const Image other = renderSamples(made->volume, scene, 128);
      double squares = 0;
      for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
        const glm::dvec4 truth(expected.pixels[i]);
        squares += glm::dot(glm::dvec4(one.pixels[i]) - truth, glm::dvec4(other.pixels[i]) - truth);
      }
      const double truth = std::sqrt(std::max(0.0, squares) / (4.0 * double(expected.pixels.size())));
      const auto launcher = makeCpuLauncher(0);
      const RenderPlan plan(made->volume, scene);
      const double found = estimateBias(*launcher, plan);
      // Quadrature stops at a transmittance of 1e-4, an error that does not depend on the step.
      EXPECT_GT(found, truth / 2 - 3e-5) << "lit " << lit << " step " << step;
      EXPECT_LT(found, truth * 2 + 1e-4) << "lit " << lit << " step " << step;
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Estimates, testing::Range(0, int(std::size(kTestScenes))),
                         [](const auto& tested) { return std::string(kTestSceneNames[tested.param]); });

/// Detail finer than a voxel, in black: only alpha shows it.
VolumeAndScene blackNoise() {
  const glm::ivec3 dims(12, 12, 12);
  std::uint32_t state = 5;
  const auto noise = [&](int, int, int) { return (state = state * 1664525u + 1013904223u) >> 24; };
  VolumeAndScene made{volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, noise)), {}};
  made.scene = framed(*made.volume, 24);
  ChannelAppearance& black = made.scene.channels[0];
  black.rangeLo = 30;
  black.rangeHi = 120;
  black.density = 0.15;
  black.color = {{0, glm::dvec3(0)}};
  made.scene.background = glm::vec3(1);
  return made;
}

TEST(Automatic, CorrectsAlphaAlone) {
  const auto [volume, framed] = blackNoise();
  Scene scene = framed;
  scene.method = Method::automatic;
  const Image expected = reference::renderReference(*volume, scene, 1).image;
  const auto renderer = makeCpuRenderer(volume, 0);
  renderer->setScene(scene);
  const std::atomic<bool> never = false;
  for (const int samples : {16, 64, 512}) {
    while (renderer->samples() < std::uint32_t(samples)) renderer->renderSample(never);
    EXPECT_GT(renderer->estimatedError(), compareImages(renderer->image(), expected).rmse / 2);
  }
  EXPECT_LT(compareImages(renderer->image(), expected).rmse, 5e-4);
}

TEST(Estimate, OfTheBiasOfBlackMatterIsThatOfItsAlpha) {
  const auto [volume, framed] = blackNoise();
  Scene scene = framed;
  scene.method = Method::raymarch;
  const Image expected = reference::renderReference(*volume, scene, 1).image;
  const auto launcher = makeCpuLauncher(0);
  for (const double step : {4.0, 1.0}) {
    scene.step = step;
    const RenderPlan plan(volume, scene);
    const double truth = compareImages(renderSamples(volume, scene, 256), expected).rmse;
    EXPECT_GT(estimateBias(*launcher, plan), truth / 3);
    EXPECT_LT(estimateBias(*launcher, plan), truth * 3);
  }
}

}  // namespace
}  // namespace scolopax
