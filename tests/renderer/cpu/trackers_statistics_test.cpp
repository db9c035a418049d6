// SPDX-License-Identifier: Apache-2.0
// The trackers against closed forms and against the double-precision reference, per pixel.
#include <gtest/gtest.h>

#include <filesystem>

#include "renderer/data/defaults.h"
#include "renderer/generate/orbitals.h"
#include "renderer/io/datasets.h"
#include "tests/support/statistics.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

class HomogeneousBox : public testing::TestWithParam<Method> {};

TEST_P(HomogeneousBox, HidesOneMinusExpOfItsThicknessSeenOrthographically) {
  const glm::ivec3 dims(20, 20, 20);
  const auto volume =
      volumeOf(gridOf(dims, glm::dvec3(0.5)), channelOf<std::uint8_t>(dims, [](int, int, int) { return 7; }));
  for (const double thickness : {1e-3, 0.1, 1.0, 5.0, 1e3, 1e6}) {
    Scene scene = frontScene(*volume, 40, 40);
    scene.channels[0] = solid(thickness / 10.0, kRed);  // 20 voxels of 0.5
    const double alpha = -std::expm1(-thickness);
    EXPECT_TRUE(
        isUnbiased(renderAnalog(volume, scene, GetParam(), 400), 400, flat(scene, {alpha, 0, 0, alpha})))
        << thickness;
  }
}

TEST_P(HomogeneousBox, HidesWhatLiesInFrontOfACameraInside) {
  const glm::ivec3 dims(9, 9, 9);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int) { return 1.0f; }));
  for (const double depth : {0.0, 0.25, 4.5, 8.999}) {  // from the far face to nearly the near one
    Scene scene = frontScene(*volume, 24, 24);
    scene.camera.eye.z = 8.5 - depth;
    scene.camera.target = scene.camera.eye + glm::dvec3(0, 0, 1);
    scene.channels[0] = solid(0.3, kBlue);
    const double alpha = -std::expm1(-0.3 * depth);
    EXPECT_TRUE(
        isUnbiased(renderAnalog(volume, scene, GetParam(), 400), 400, flat(scene, {0, 0, alpha, alpha})))
        << depth;
  }
}

TEST_P(HomogeneousBox, SharesItsCollisionsAmongChannelsByTheirExtinction) {
  const glm::ivec3 dims(8, 8, 8);
  const auto one = [](int, int, int) { return 1; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, one),
                               channelOf<std::uint16_t>(dims, one), channelOf<std::int16_t>(dims, one));
  Scene scene = frontScene(*volume, 32, 32);
  scene.channels = {solid(0.02, kRed), solid(0.05, kGreen), solid(0.13, kBlue)};
  const double alpha = -std::expm1(-0.2 * 8);
  EXPECT_TRUE(isUnbiased(renderAnalog(volume, scene, GetParam(), 1000), 1000,
                         flat(scene, glm::dvec4(0.1, 0.25, 0.65, 1) * alpha)));
}

INSTANTIATE_TEST_SUITE_P(Methods, HomogeneousBox, testing::ValuesIn(kTrackers), [](const auto& tested) {
  std::string name(nameOf(tested.param));
  std::erase(name, '-');
  return name;
});

/// Gives every channel a colour of zeros and ones, so that the pixels are binomial.
void paintPrimaries(Scene& scene) {
  const glm::dvec3 colors[] = {kRed, kGreen, kBlue, kWhite};
  for (std::size_t i = 0; i < scene.channels.size(); ++i) scene.channels[i].color = {{0, colors[i % 4]}};
}

void useDefaults(const Volume& volume, Scene& scene) {
  scene.channels.resize(volume.channels().size());
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    const ValueRange range = defaultRange(volume.facts(), int(i));
    scene.channels[i].rangeLo = range.lo;
    scene.channels[i].rangeHi = range.hi;
    scene.channels[i].density = defaultDensity(volume.facts(), int(i));
  }
  scene.camera = framingCamera(volume.grid(), 35, double(scene.width) / scene.height);
  paintPrimaries(scene);
}

TEST(Trackers, MatchTheReferenceOnTheOrbitals) {
  GeneratedVolume generated = generateOrbitals(48, 4);
  const auto volume = std::make_shared<const Volume>(generated.grid, std::move(generated.channels));
  Scene scene;
  scene.width = 56;
  scene.height = 48;
  useDefaults(*volume, scene);
  expectTrackersMatchReference(volume, scene, 500, 4);
}

TEST(Trackers, MatchTheReferenceOnTheFourChannelMri) {
  const std::filesystem::path folder = std::filesystem::path(SCOLOPAX_DATA_DIR) / "multichannel/tcga_du_7294";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  std::vector<std::filesystem::path> files;
  for (const char* name : {"t1", "t1c", "t2", "fla"})
    files.push_back(folder / ("TCGA-DU-7294_" + std::string(name) + "_bet.nii.gz"));
  const auto datasets = io::loadDatasets(files, io::defaultMemoryLimitBytes(), [](const std::string&) {});
  ASSERT_EQ(datasets.size(), 1u);
  const auto volume = datasets[0].volume;
  Scene scene;
  scene.width = 40;
  scene.height = 40;
  scene.filter = PixelFilter::point;
  useDefaults(*volume, scene);
  expectTrackersMatchReference(volume, scene, 500);
}

TEST(Trackers, MatchTheReferenceOnNoiseWithJumpsSpikesAndGamma) {
  const glm::ivec3 dims(11, 7, 13);
  std::uint32_t state = 9;
  const auto noise = [&](int, int, int) { return (state = state * 1664525u + 1013904223u) >> 24; };
  const auto volume = volumeOf(gridOf(dims, {1, 2.5, 0.4}), channelOf<std::uint8_t>(dims, noise),
                               channelOf<std::uint16_t>(dims, noise), channelOf<float>(dims, noise),
                               channelOf<std::int16_t>(dims, noise, -2, 300));
  Scene scene;
  scene.width = 40;
  scene.height = 40;
  useDefaults(*volume, scene);
  scene.channels[0].opacity = {{0, 0}, {0.3, 0}, {0.3, 1}, {0.4, 1}, {0.4, 0.1}, {1, 0}};
  scene.channels[1].opacity = {{0, 0.02}, {0.5, 0.02}, {0.5 + 0x1p-8, 1}, {0.5 + 0x1p-7, 0.02}};
  scene.channels[2].gamma = 2.2;
  scene.channels[3].rangeLo = 250;  // reversed
  scene.channels[3].rangeHi = -100;
  const auto expected = reference::renderReference(*volume, scene, 4);
  for (const int macrocell : {1, 4, 5}) {
    scene.macrocell = macrocell;
    expectTrackersMatch(expected, volume, scene, 500);
  }
}

TEST(Trackers, AreCaughtWhenTheirBoundIsTooLow) {
  // The negative control of this test: a picture whose extinction is 5 % off must not pass.
  const glm::ivec3 dims(8, 8, 8);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  Scene scene = frontScene(*volume, 32, 32);
  scene.channels = {solid(0.095, kRed)};
  const double alpha = -std::expm1(-0.1 * 8);
  EXPECT_FALSE(isUnbiased(renderAnalog(volume, scene, Method::superposed, 500), 500,
                          flat(scene, {alpha, 0, 0, alpha})));
}

}  // namespace
}  // namespace scolopax
