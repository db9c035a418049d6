// SPDX-License-Identifier: Apache-2.0
// The cost of light, in counts: none if it is off or has no visible effect; otherwise only the necessary
// cost. Every method, every blend mode.
#include <gtest/gtest.h>

#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

class LightCosts : public testing::TestWithParam<BlendMode> {
 protected:
  LightCosts() : made_(*testScene(TestScene::lumps)) {
    scene_ = made_.scene;
    scene_.blend = GetParam();
    scene_.width = scene_.height = 16;
  }
  static constexpr int kCostSamples = 4;
  RenderStats stats(const Scene& scene, Method method) const {
    return statsOf(made_.volume, scene, method, kCostSamples);
  }
  /// Number of collisions in all samples, for methods in which a ray ends at one collision.
  double collisions(Scene scene, Method method) const {
    scene.method = method;
    const auto renderer = makeCpuRenderer(made_.volume, 0);
    renderer->setScene(scene);
    const std::atomic<bool> never = false;
    for (int i = 0; i < kCostSamples; ++i) renderer->renderSample(never);
    double sum = 0;
    for (const glm::vec4& p : renderer->image().pixels) sum += double(p.a) * kCostSamples;
    return sum;
  }
  static void expectSame(const RenderStats& a, const RenderStats& b, Method method) {
    EXPECT_EQ(a.fetches, b.fetches) << nameOf(method);
    EXPECT_EQ(a.cellSteps, b.cellSteps) << nameOf(method);
    EXPECT_EQ(a.randomBlocks, b.randomBlocks) << nameOf(method);
  }

  VolumeAndScene made_;
  Scene scene_;
};
INSTANTIATE_TEST_SUITE_P(BlendModes, LightCosts, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

TEST_P(LightCosts, AreNoneWhereLightIsOffHoweverManyLightsThereAre) {
  for (const Method method : kAllMethods) {
    Scene bare = scene_;
    bare.lights.clear();
    for (auto& channel : bare.channels) channel.material = {};
    expectSame(stats(scene_, method), stats(bare, method), method);
  }
}

TEST_P(LightCosts, OfShadingAreSixFetchesForEveryChannelShownAndNoRay) {
  scene_.shading = false;
  for (const Method method : kAllMethods) {
    Scene shaded = scene_;
    shaded.shading = true;
    const RenderStats off = stats(scene_, method), on = stats(shaded, method);
    EXPECT_EQ(on.cellSteps, off.cellSteps) << nameOf(method);
    // Quadrature draws the places at which it computes lighting.
    if (!hasStep(method)) {
      EXPECT_EQ(on.randomBlocks, off.randomBlocks) << nameOf(method);
    }
    EXPECT_EQ((on.fetches - off.fetches) % 6, 0u) << nameOf(method);
    EXPECT_GT(on.fetches, off.fetches) << nameOf(method);
    const bool one = scene_.blend == BlendMode::density || scene_.blend == BlendMode::max;
    if (!one || hasStep(method)) continue;
    EXPECT_NEAR(double(on.fetches - off.fetches), 6 * collisions(scene_, method), 0.01) << nameOf(method);
  }
}

TEST_P(LightCosts, OfShadowsAreRaysAndNoGradient) {
  for (const Method method : kAllMethods) {
    Scene shadowed = scene_;
    shadowed.shadows = true;
    const RenderStats off = stats(scene_, method), on = stats(shadowed, method);
    EXPECT_GT(on.cellSteps, off.cellSteps) << nameOf(method);
    EXPECT_GT(on.randomBlocks, off.randomBlocks) << nameOf(method);
    // Shading in addition only adds gradients.
    Scene both = shadowed;
    both.shading = true;
    const RenderStats lit = stats(both, method);
    EXPECT_EQ(lit.cellSteps, on.cellSteps) << nameOf(method);
    EXPECT_EQ(lit.randomBlocks, on.randomBlocks) << nameOf(method);
    EXPECT_EQ((lit.fetches - on.fetches) % 6, 0u) << nameOf(method);
  }
}

TEST_P(LightCosts, OfShadowsOfBlackLightsAreNone) {
  for (const Method method : kAllMethods) {
    Scene black = scene_;
    black.shadows = true;
    black.lights[0].intensity = 0;
    black.lights[1].color = glm::dvec3(0);
    expectSame(stats(black, method), stats(scene_, method), method);
    Scene one = scene_, two = scene_;
    one.shadows = two.shadows = true;
    one.lights.resize(1);
    two.lights[1].intensity = 0;
    expectSame(stats(one, method), stats(two, method), method);
  }
}

TEST_P(LightCosts, OfShadowsOnMatterThatIsFullyAmbientAreNone) {
  for (auto& channel : scene_.channels) channel.material = {1, 0, 0, 1};
  for (const Method method : kAllMethods) {
    Scene shadowed = scene_;
    shadowed.shadows = true;
    expectSame(stats(shadowed, method), stats(scene_, method), method);
    // One channel on which light has an effect is enough.
    shadowed.channels[1].material.ambient = 0.5;
    EXPECT_GT(stats(shadowed, method).cellSteps, stats(scene_, method).cellSteps);
    // Unless it is hidden.
    shadowed.channels[1].visible = false;
    Scene hidden = scene_;
    hidden.channels[1].visible = false;
    expectSame(stats(shadowed, method), stats(hidden, method), method);
  }
}

}  // namespace
}  // namespace scolopax
