// SPDX-License-Identifier: Apache-2.0
// Defects in opacity by the gradient, seeded intentionally. The comparison with the reference must detect
// each of them; defects_statistics_test.cpp has the other defects.
#include <gtest/gtest.h>

#include <functional>

#include "renderer/kernel/raymarch.h"
#include "renderer/kernel/trackers/one_process.h"
#include "renderer/metrics/metrics.h"
#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"
#include "tests/support/gradients.h"

namespace scolopax {
namespace {

using namespace test;
using kernel::Lit;
using kernel::SceneView;
using kernel::Unlit;

/// Shadow rays, which begin inside the box, use the opacity without the factor.
struct ShadowsWithoutFactors {
  template <class Blend>
  static std::optional<kernel::Collision> track(SceneView scene, const kernel::Ray& ray,
                                                kernel::Interval inside, kernel::Sampler& sampler,
                                                kernel::SampleCost* cost) {
    std::vector<kernel::ChannelView> channels(scene.channels, scene.channels + scene.channelCount);
    if (!(inside.enter > 0)) {
      for (kernel::ChannelView& channel : channels) channel.factor.curve.count = 0;
      scene.channels = channels.data();
    }
    return kernel::Superposed::track<Blend>(scene, ray, inside, sampler, cost);
  }
};

class GradientDefect : public testing::Test {
 protected:
  void use(TestScene which, bool shadows = false) {
    made_ = *testScene(which);
    made_.scene.shadows = shadows;
    if (shadows) made_.scene.width = made_.scene.height = 6;
    for (std::size_t n = 0; n < made_.scene.channels.size(); ++n)
      made_.scene.channels[n].gradientOpacity = factorBetween(*made_.volume, n, 0.2, 0.9);
    expected_ = reference::renderReference(*made_.volume, made_.scene, 1);
  }
  template <class Tracker = kernel::Superposed, class Lighting = Unlit, class Change>
  ::testing::AssertionResult trackerPasses(Change&& change) {
    return haveMean(replicateKernel<kernel::Analog<Tracker>, kernel::BlendDensity, Lighting>(
                        made_.volume, made_.scene, change),
                    made_.scene, expected_);
  }
  /// RMSE of quadrature at a short step.
  template <class Change>
  double marcherError(Change&& change) {
    made_.scene.method = Method::raymarch;
    made_.scene.step = 0.1;
    const auto found = replicateKernel<kernel::RayMarch<kernel::EqualSteps>, kernel::BlendDensity, Unlit>(
        made_.volume, made_.scene, change);
    return compareImages(found.pictures[0], expected_.image).rmse;
  }
  /// Calls change(factor) for copies of the view's channels.
  auto inFactors(std::function<void(kernel::GradientFactorView&)> change) {
    return [this, change](SceneView& view) {
      channels_.assign(view.channels, view.channels + view.channelCount);
      view.channels = channels_.data();
      for (kernel::ChannelView& channel : channels_) change(channel.factor);
    };
  }

  VolumeAndScene made_;
  reference::ReferenceImage expected_;
  std::vector<kernel::ChannelView> channels_;
};

// GradientLooks.AreWhatQuadratureApproaches allows 1.5e-3.
constexpr double kQuadratureError = 1.5e-3;

TEST_F(GradientDefect, NoneIsFoundWhereThereIsNone) {
  for (const TestScene which : {TestScene::lumps, TestScene::noise}) {
    use(which);
    EXPECT_TRUE(trackerPasses(inFactors([](kernel::GradientFactorView&) {})));
  }
  use(TestScene::lumps);
  EXPECT_LT(marcherError([](SceneView&) {}), kQuadratureError);
  use(TestScene::lumps, true);
  EXPECT_TRUE((trackerPasses<kernel::Superposed, Lit>([](SceneView&) {})));
}

TEST_F(GradientDefect, OfAFactorThatIsIgnoredIsFound) {
  use(TestScene::lumps);
  const auto ignored = inFactors([](kernel::GradientFactorView& factor) { factor.curve.count = 0; });
  EXPECT_FALSE(trackerPasses(ignored));
  EXPECT_GT(marcherError(ignored), 10 * kQuadratureError);
  // The bounds are changed, too, since they would otherwise limit the excess.
  Scene without = made_.scene;
  for (ChannelAppearance& channel : without.channels) channel.gradientOpacity.reset();
  EXPECT_FALSE(haveMean(replicate(made_.volume, without, Method::superposed), made_.scene, expected_));
}

TEST_F(GradientDefect, OfShadowsThatIgnoreItIsFound) {
  use(TestScene::lumps, true);
  EXPECT_FALSE((trackerPasses<ShadowsWithoutFactors, Lit>([](SceneView&) {})));
}

TEST_F(GradientDefect, OfGradientsInUnitsOfVoxelsIsFound) {
  use(TestScene::lumps);  // spacing 1 : 0.8 : 1.7
  const auto perVoxel =
      inFactors([](kernel::GradientFactorView& factor) { factor.fromVoxel = glm::mat3(1.0f); });
  EXPECT_FALSE(trackerPasses(perVoxel));
  EXPECT_GT(marcherError(perVoxel), 3 * kQuadratureError);
}

TEST_F(GradientDefect, OfARangePerSmallestSpacingIsFound) {
  use(TestScene::lumps);
  const double spacing = made_.volume->grid().smallestSpacing();
  const auto perSpacing = inFactors([spacing](kernel::GradientFactorView& factor) {
    factor.scale *= float(spacing);
    factor.origin /= float(spacing);
  });
  EXPECT_FALSE(trackerPasses(perSpacing));
  EXPECT_GT(marcherError(perSpacing), 3 * kQuadratureError);
}

TEST_F(GradientDefect, OfARangeOfStoredValuesIsFound) {
  use(TestScene::noise);
  EXPECT_FALSE(trackerPasses(inFactors([this](kernel::GradientFactorView& factor) {
    if (&factor != &channels_[1].factor) return;  // of slope -2
    factor.scale /= 2;
    factor.origin *= 2;
  })));
}

TEST_F(GradientDefect, OfARangeThatIsShiftedIsFound) {
  use(TestScene::lumps);
  EXPECT_FALSE(trackerPasses(inFactors([](kernel::GradientFactorView& factor) { factor.offset += 0.1f; })));
}

}  // namespace
}  // namespace scolopax
