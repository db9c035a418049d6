// SPDX-License-Identifier: Apache-2.0
// Opacity by the gradient against tiny steps, on random small volumes on all kinds of grids: the reference's
// bound on its own error must hold in all blend modes and lights.
#include <gtest/gtest.h>

#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/lit_march.h"
#include "tests/renderer/reference/random_light.h"
#include "tests/support/statistics.h"

namespace scolopax::reference {
namespace {

/// Compares one ray through each of `usualCount` random scenes with tiny steps: the claimed error bounds must
/// hold.
void expectFactorClaimsHold(bool shading, bool shadows, int usualCount, int steps, double largestClaim) {
  const int count = test::timesFactor(usualCount);
  int seen = 0;
  for (unsigned seed = 1; seed <= unsigned(count); ++seed) {
    RandomLight draw(seed);
    const Volume volume = draw.volume();
    Scene scene = draw.scene(volume);
    scene.shading = shading;
    scene.shadows = shadows;
    for (std::size_t n = 0; n < scene.channels.size(); ++n)
      if (n == 0 || draw.chance(0.5)) scene.channels[n].gradientOpacity = draw.factor(volume, n);
    const RandomRay ray(draw, volume, seed);
    const RayResult found = traceReference(volume, scene, ray.origin, ray.direction);
    const March expected = LitMarcher(volume, scene).march(ray.origin, ray.direction, steps, steps);
    for (int c = 0; c < 4; ++c)
      EXPECT_NEAR(found.rgba[c], expected.rgba[c], found.error + expected.bound)
          << "seed " << seed << " component " << c;
    EXPECT_LE(found.error, largestClaim) << "seed " << seed;
    seen += found.rgba.a > 0.01;
  }
  EXPECT_GT(seen, count / 2);
}

// kTolerance and kToleranceLit are tolerances of one piece; blend mode composite adds three channels.
TEST(ReferenceGradientOpacity, KeepsWhatItClaimsOnRandomScenes) {
  expectFactorClaimsHold(false, false, 150, 20000, 4 * Integrator::kTolerance);
}
TEST(ReferenceGradientOpacity, KeepsWhatItClaimsInShadedRandomScenes) {
  expectFactorClaimsHold(true, false, 100, 20000, 4 * Integrator::kToleranceLit);
}
TEST(ReferenceGradientOpacity, KeepsWhatItClaimsInRandomScenesWithShadows) {
  expectFactorClaimsHold(false, true, 12, 500, 4 * Integrator::kToleranceLit);
  expectFactorClaimsHold(true, true, 12, 500, 4 * Integrator::kToleranceLit);
}

}  // namespace
}  // namespace scolopax::reference
