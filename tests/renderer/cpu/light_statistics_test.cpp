// SPDX-License-Identifier: Apache-2.0
// Every tracker in every blend mode and light configuration against the reference, per pixel; and what a
// marcher owes: convergence as its step shrinks.
#include <gtest/gtest.h>

#include <algorithm>

#include "renderer/generate/orbitals.h"
#include "renderer/metrics/metrics.h"
#include "tests/support/statistics.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

constexpr BlendMode kBlends[] = {BlendMode::density, BlendMode::max, BlendMode::mix, BlendMode::composite};

/// Three overlapping channels of different types on a grid of unequal spacing, materials and weights that
/// differ, two lights.
Scene litScene(const Volume& volume, BlendMode blend, bool shading, bool shadows) {
  Scene scene;
  scene.width = scene.height = 20;
  scene.filter = PixelFilter::point;
  scene.camera = framingCamera(volume.grid(), 35, 1);
  scene.channels.resize(3);
  for (std::size_t i = 0; i < 3; ++i) {
    ChannelAppearance& a = scene.channels[i];
    a.rangeHi = volume.channels()[i].histogram.maximum;
    a.density = 0.25 + 0.1 * double(i);
    a.color = {{0, glm::dvec3(i == 0, i == 1, i == 2)}};
    a.weight = 0.5 + 0.5 * double(i);
    a.material = {0.2 + 0.1 * double(i), 0.6, 0.1 + 0.2 * double(i), 5.0 + 10.0 * double(i)};
  }
  scene.blend = blend;
  scene.shading = shading;
  scene.shadows = shadows;
  scene.lights = {{LightType::directional, {0.4, -0.7, -0.6}, {1, 0.9, 0.8}, 0.9},
                  {LightType::point, {20, 25, -10}, {0.3, 0.5, 1}, 0.5}};
  return scene;
}

std::shared_ptr<const Volume> lumpyVolume() {
  const glm::ivec3 dims(12, 14, 9);
  const auto field = [](double phase) {
    return [phase](int x, int y, int z) {
      const double v =
          std::sin(0.6 * x + phase) * std::cos(0.5 * y - phase) + 0.4 * std::sin(0.8 * z + 2 * phase);
      return std::max(0.0, 90 * (v + 0.4));
    };
  };
  return volumeOf(gridOf(dims, {1, 0.8, 1.7}), channelOf<std::uint8_t>(dims, field(0)),
                  channelOf<float>(dims, field(1.3)), channelOf<std::uint16_t>(dims, field(2.4)));
}

/// Lit samples are not 0 or 1, so the variance comes from the samples: 64 seeds of 8 samples each.
struct Replicates {
  std::vector<glm::dvec4> mean, varianceOfMean;
};
Replicates replicate(const std::shared_ptr<const Volume>& volume, Scene scene, Method method) {
  constexpr int kReplicates = 64, kSamples = 8;
  scene.method = method;
  Replicates result;
  for (int r = 0; r < kReplicates; ++r) {
    scene.seed = std::uint32_t(1000 + r);
    const Image image = renderSamples(volume, scene, kSamples);
    result.mean.resize(image.pixels.size(), glm::dvec4(0));
    result.varianceOfMean.resize(image.pixels.size(), glm::dvec4(0));
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const glm::dvec4 v(image.pixels[i]);
      result.mean[i] += v / double(kReplicates);
      result.varianceOfMean[i] += v * v / double(kReplicates);
    }
  }
  for (std::size_t i = 0; i < result.mean.size(); ++i)
    result.varianceOfMean[i] =
        (result.varianceOfMean[i] - result.mean[i] * result.mean[i]) / (kReplicates - 1.0);
  return result;
}

/// The mean over all pixels of each component, and the mean squared deviation in units of its variance. With
/// estimated variances of 63 degrees of freedom the latter is 63/61 = 1.03 without bias; over 400 pixels and
/// four components that depend on each other its standard deviation stays below 0.13: 1.6 is over 4 sigma,
/// and is reached by a bias as large as three quarters of one pixel's noise.
::testing::AssertionResult agrees(const Replicates& found, const reference::ReferenceImage& expected) {
  double squares = 0;
  int counted = 0;
  for (int c = 0; c < 4; ++c) {
    double sum = 0, variance = 0;
    for (std::size_t i = 0; i < found.mean.size(); ++i) {
      const double d = found.mean[i][c] - double(expected.image.pixels[i][c]);
      sum += d;
      variance += found.varianceOfMean[i][c];
      if (found.varianceOfMean[i][c] < 1e-6) continue;  // a handful of hits: no normal law
      squares += std::min(d * d / found.varianceOfMean[i][c], 40.0);
      ++counted;
    }
    if (std::abs(sum) > 5 * std::sqrt(variance) + 1e-4 * double(found.mean.size()))
      return ::testing::AssertionFailure()
             << "component " << c << ": the mean is " << sum / std::sqrt(variance) << " sigma off";
  }
  const double ratio = squares / std::max(counted, 1);
  if (ratio > 1.6)
    return ::testing::AssertionFailure() << "squared deviations are " << ratio << " of their variance";
  return ::testing::AssertionSuccess();
}

class LitTrackers : public testing::TestWithParam<BlendMode> {};

TEST_P(LitTrackers, MatchTheReferenceInEveryLight) {
  const auto volume = lumpyVolume();
  for (const bool shading : {false, true})
    for (const bool shadows : {false, true}) {
      const Scene scene = litScene(*volume, GetParam(), shading, shadows);
      const auto expected = reference::renderReference(*volume, scene, 1);
      for (const Method method : kTrackers)
        EXPECT_TRUE(agrees(replicate(volume, scene, method), expected))
            << nameOf(method) << (shading ? " shading" : "") << (shadows ? " shadows" : "");
    }
}

TEST_P(LitTrackers, AreToldApartFromALightThatShinesTheOtherWay) {
  // The negative control: what this harness must not let pass.
  const auto volume = lumpyVolume();
  const Scene scene = litScene(*volume, GetParam(), true, true);
  Scene flipped = scene;
  flipped.lights[0].vector = -flipped.lights[0].vector;
  const auto expected = reference::renderReference(*volume, scene, 1);
  EXPECT_FALSE(agrees(replicate(volume, flipped, Method::superposed), expected));
}

TEST_P(LitTrackers, AreApproachedByTheMarcherAsItsStepShrinks) {
  const auto volume = lumpyVolume();
  for (const bool lit : {false, true}) {
    Scene scene = litScene(*volume, GetParam(), lit, lit);
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

INSTANTIATE_TEST_SUITE_P(BlendModes, LitTrackers, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

}  // namespace
}  // namespace scolopax
