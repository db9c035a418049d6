// SPDX-License-Identifier: Apache-2.0
// All interpolations against tiny steps, on random small volumes on all kinds of grids: the reference's bound
// on its own error must hold, with everything that depends on the scalar or its gradient.
#include <gtest/gtest.h>

#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/lit_march.h"
#include "tests/renderer/reference/random_light.h"
#include "tests/support/statistics.h"

namespace scolopax::reference {
namespace {

/// The features of the scenes.
struct Features {
  bool shading = false, shadows = false, factors = false, surfaces = false;
};

/// Isovalues within and around a channel's values, which are from -20 to 107.5.
std::vector<Isovalue> randomSurfaces(RandomLight& draw) {
  std::vector<Isovalue> isovalues;
  for (int i = draw.among(1, 3); i > 0; --i) {
    isovalues.push_back({-25 + 140 * draw.unit(), 0.1 + 0.8 * draw.unit(), {}});
    if (draw.chance(0.5)) isovalues.back().color = glm::dvec3(draw.unit(), draw.unit(), draw.unit());
  }
  return isovalues;
}

/// Compares one ray through each of `usualCount` random scenes with tiny steps. `largestClaim` holds for one
/// channel.
void expectFeatureClaimsHold(const Features& has, int usualCount, int steps, double largestClaim) {
  const int count = test::timesFactor(usualCount);
  int seen = 0;
  for (unsigned seed = 1; seed <= unsigned(count); ++seed) {
    RandomLight draw(seed);
    const Volume volume = draw.volume();
    Scene scene = draw.scene(volume);
    scene.shading = has.shading;
    scene.shadows = has.shadows;
    for (std::size_t n = 0; n < scene.channels.size(); ++n) {
      ChannelAppearance& channel = scene.channels[n];
      // Mostly cubic or nearest, and all three together.
      const Interpolation all[] = {Interpolation::cubic, Interpolation::nearest, Interpolation::trilinear};
      channel.interpolation = n == 0 ? all[seed % 2] : all[draw.among(0, 2)];
      if (has.factors && draw.chance(0.7)) channel.gradientOpacity = draw.factor(volume, n);
      if (has.surfaces) channel.isovalues = randomSurfaces(draw);
    }
    const RandomRay ray(draw, volume, seed);
    const RayResult found = traceReference(volume, scene, ray.origin, ray.direction);
    const March expected = LitMarcher(volume, scene).march(ray.origin, ray.direction, steps, steps);
    for (int c = 0; c < 4; ++c)
      EXPECT_NEAR(found.rgba[c], expected.rgba[c], found.error + expected.bound)
          << "seed " << seed << " component " << c << " blend " << nameOf(scene.blend);
    EXPECT_LE(found.error, largestClaim * double(scene.channels.size())) << "seed " << seed;
    seen += found.rgba.a > 0.01;
  }
  EXPECT_GT(seen, count / 2);
}

// kTolerance and kToleranceLit are tolerances of one piece.
TEST(ReferenceInterpolation, KeepsWhatItClaimsOnRandomScenes) {
  expectFeatureClaimsHold({}, 120, 10000, 2 * Integrator::kTolerance);
}
TEST(ReferenceInterpolation, KeepsWhatItClaimsOfOpacityByTheGradient) {
  expectFeatureClaimsHold({.factors = true}, 80, 10000, 2 * Integrator::kTolerance);
}
TEST(ReferenceInterpolation, KeepsWhatItClaimsWithShading) {
  expectFeatureClaimsHold({.shading = true}, 80, 10000, 2 * Integrator::kToleranceLit);
  expectFeatureClaimsHold({.shading = true, .factors = true}, 40, 10000, 2 * Integrator::kToleranceLit);
}
TEST(ReferenceInterpolation, KeepsWhatItClaimsWithSurfaces) {
  expectFeatureClaimsHold({.surfaces = true}, 80, 10000, 2 * Integrator::kTolerance);
  expectFeatureClaimsHold({.shading = true, .factors = true, .surfaces = true}, 80, 10000,
                          2 * Integrator::kToleranceLit);
}
TEST(ReferenceInterpolation, KeepsWhatItClaimsWithShadows) {
  expectFeatureClaimsHold({.shadows = true}, 10, 300, 2 * Integrator::kToleranceLit);
  expectFeatureClaimsHold({.shading = true, .shadows = true, .factors = true}, 10, 300,
                          2 * Integrator::kToleranceLit);
}

}  // namespace
}  // namespace scolopax::reference
