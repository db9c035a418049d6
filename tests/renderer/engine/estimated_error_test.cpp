// SPDX-License-Identifier: Apache-2.0
// The error that the method `auto` claims is its true error.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "renderer/io/datasets.h"
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

void expectKnownError(const std::shared_ptr<const Volume>& volume, const Scene& scene, const Image& truth) {
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
  scene.method = Method::automatic;
  scene.filter = PixelFilter::point;
  expectKnownError(volume, scene, reference::renderReference(*volume, scene, 1).image);
}

TEST(EstimatedError, OfFourMriContrastsIsTrueFromTheFirstSamplesOn) {
  // The scene of tests/bench/scenes/tcga.json. Its pixels have an area: through their centres, unlit pictures
  // have no noise, and errors of 1e-6.
  std::vector<std::filesystem::path> files;
  for (const char* contrast : {"fla", "t1", "t1c", "t2"})
    files.push_back(std::filesystem::path(SCOLOPAX_DATA_DIR) / "multichannel/tcga_du_7294" /
                    (std::string("TCGA-DU-7294_") + contrast + "_bet.nii.gz"));
  for (const auto& file : files)
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "the data set is absent from " << SCOLOPAX_DATA_DIR;
  const auto datasets = io::loadDatasets(files, io::defaultMemoryLimitBytes(), [](const std::string&) {});
  Scene scene;
  scene.method = Method::automatic;
  scene.width = scene.height = 32;
  scene.camera.eye = {-330, 380, 210};
  scene.camera.target = {-119, 108, 70};
  scene.camera.up = {0, 0, 1};
  scene.camera.fovY = 23;
  const auto look = [](double low, double high, double density, glm::dvec3 color,
                       std::vector<OpacityKnot> opacity) {
    ChannelAppearance channel;
    channel.rangeLo = low;
    channel.rangeHi = high;
    channel.density = density;
    channel.color = {{0, color}};
    channel.opacity = std::move(opacity);
    return channel;
  };
  scene.channels = {
      look(380, 600, 0.6, {1, 0.1, 0.05}, {{0, 0}, {0.25, 0.02}, {1, 1}}),
      look(100, 700, 0.1, {0.7, 0.6, 0.55}, {{0, 0}, {0.15, 0.1}, {0.6, 0.12}, {0.8, 0.4}, {1, 0.6}}),
      look(620, 1500, 1, {1, 0.65, 0.05}, {{0, 0}, {0.1, 0.05}, {1, 1}}),
      look(900, 2400, 0.4, {0.05, 0.45, 1}, {{0, 0}, {0.1, 0.02}, {1, 1}})};
  const auto volume = datasets.at(0).volume;
  Scene other = scene;
  other.seed = 1000;
  // The noise of the truth adds 1/32 to the squared error of 64 samples, and 1/16 to that of 512.
  expectKnownError(volume, scene, renderSamples(volume, other, allCombinations() ? 8192 : 2048));
}

}  // namespace
}  // namespace scolopax
