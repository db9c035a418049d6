// SPDX-License-Identifier: Apache-2.0
// What a marcher owes: convergence to the reference as its step shrinks, lit and unlit, in every blend mode.
#include <gtest/gtest.h>

#include "renderer/metrics/metrics.h"
#include "tests/support/estimator_scenes.h"
#include "tests/support/statistics.h"

namespace scolopax {
namespace {

using namespace test;

class Marcher : public testing::TestWithParam<BlendMode> {};

TEST_P(Marcher, ApproachesTheReferenceAsItsStepShrinks) {
  const auto [volume, framed] = *testScene(TestScene::lumps);
  for (const bool lit : {false, true}) {
    Scene scene = framed;
    scene.width = scene.height = 20;
    scene.blend = GetParam();
    scene.shading = scene.shadows = lit;
    scene.method = Method::raymarch;
    const Image expected = reference::renderReference(*volume, scene, 1).image;
    const auto errorAt = [&](double step) {
      scene.step = step;
      return compareImages(renderSamples(volume, scene, 96), expected).rmse;
    };
    const double coarse = errorAt(2), middle = errorAt(1), fine = errorAt(0.25);
    // The jittered mean converges with order 2 where the integrand is smooth; the jitter's own noise, of 96
    // samples, is what is left of it at the finest step.
    EXPECT_LT(middle, coarse / 2) << nameOf(GetParam()) << " lit " << lit;
    EXPECT_LT(fine, 2e-3) << nameOf(GetParam()) << " lit " << lit;
  }
}

INSTANTIATE_TEST_SUITE_P(BlendModes, Marcher, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

}  // namespace
}  // namespace scolopax
