// SPDX-License-Identifier: Apache-2.0
// The error that the method `auto` claims is its true error.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "renderer/metrics/metrics.h"
#include "renderer/reference/render.h"
#include "renderer/renderer.h"
#include "tests/support/orbitals.h"
#include "tests/support/statistics.h"

namespace scolopax {
namespace {

using namespace test;

/// Estimated error by true error, median over ten seeds.
double medianRatio(const std::shared_ptr<const Volume>& volume, Scene scene, const Image& truth,
                   int samples) {
  std::vector<double> ratios;
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    scene.seed = seed;
    const auto renderer = makeCpuRenderer(volume, 0);
    renderer->setScene(scene);
    for (int i = 0; i < samples; ++i) renderer->renderSample(kNever);
    ratios.push_back(renderer->estimatedError() / compareImages(renderer->image(), truth).rmse);
  }
  std::sort(ratios.begin(), ratios.end());
  return (ratios[4] + ratios[5]) / 2;
}

void expectKnownError(const std::shared_ptr<const Volume>& volume, Scene scene) {
  scene.method = Method::automatic;
  scene.filter = PixelFilter::point;
  const Image truth = reference::renderReference(*volume, scene, 1).image;
  EXPECT_NEAR(medianRatio(volume, scene, truth, 16), 1, 0.25);
  EXPECT_NEAR(medianRatio(volume, scene, truth, 64), 1, 0.2);
  if (allCombinations()) {
    EXPECT_NEAR(medianRatio(volume, scene, truth, 512), 1, 0.2);
  }
}

TEST(EstimatedError, OfOrbitalsInLightIsTrueFromTheFirstSamplesOn) {
  const auto volume = orbitals();
  Scene scene = orbitalScene(*volume);
  scene.shading = scene.shadows = true;
  expectKnownError(volume, scene);
}

}  // namespace
}  // namespace scolopax
