// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/resolution.h"

#include <gtest/gtest.h>

#include "renderer/data/render_plan.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

TEST(Resolution, OfAPlanIsThatOfItsScene) {
  // The bias is estimated at a view's resolution. At another resolution it would be that of a different
  // picture.
  const glm::ivec3 dims(4);
  const auto volume =
      volumeOf(gridOf(dims, {1, 2, 0.5}), channelOf<std::uint8_t>(dims, [](int x, int, int) { return x; }));
  for (const Interpolation interpolation :
       {Interpolation::trilinear, Interpolation::cubic, Interpolation::nearest})
    for (const double step : {0.0, 0.25, 1.0, 8.0}) {
      Scene scene = frontScene(*volume, 4, 4);
      scene.method = Method::raymarch;
      scene.step = step;
      scene.channels[0].interpolation = interpolation;
      const RenderPlan plan(volume, scene);
      kernel::SceneView view = plan.view();
      setResolution(view, resolutionOf(scene));
      EXPECT_EQ(view.step, plan.view().step) << step;
      EXPECT_EQ(view.voxelwise, plan.view().voxelwise) << step;
      EXPECT_EQ(view.thickest, plan.view().thickest) << step;
      EXPECT_EQ(view.opaque.transmittance, plan.view().opaque.transmittance) << step;
      EXPECT_EQ(view.opaque.depth, plan.view().opaque.depth) << step;
    }
}

TEST(Resolution, OfTheLadderBecomesFinerRungByRung) {
  for (int i = 1; i < kResolutions; ++i) {
    const Resolution before = resolutionAt(i - 1), here = resolutionAt(i);
    EXPECT_EQ(here.voxelwise, i >= kEqualSteps);
    if (i != kEqualSteps) {
      EXPECT_LT(here.step, before.step) << i;
    }
  }
}

TEST(Resolution, OfEstimatesDividesTheLongestRayIntoAtMost65536Steps) {
  EXPECT_DOUBLE_EQ(finestEstimatedStep(gridOf({1 << 16, 1, 1}, {1e-3, 1e6, 1e6})) * 0x1p16 * 1e-3,
                   gridOf({1 << 16, 1, 1}, {1e-3, 1e6, 1e6}).diagonal());
  EXPECT_NEAR(finestEstimatedStep(gridOf({1 << 16, 1, 1})), 1, 1e-6);
  EXPECT_NEAR(finestEstimatedStep(gridOf({1, 1, 1 << 10}, {2, 2, 2})), 1.0 / 64, 1e-6);
}

}  // namespace
}  // namespace scolopax
