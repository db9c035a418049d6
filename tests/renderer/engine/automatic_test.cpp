// SPDX-License-Identifier: Apache-2.0
// The CPU backend's choice of a method for scenes with the method `auto`.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/engine/pilot.h"
#include "renderer/io/datasets.h"
#include "renderer/metrics/metrics.h"
#include "renderer/reference/render.h"
#include "renderer/renderer.h"
#include "tests/support/orbitals.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

Scene automaticScene(const Volume& volume) {
  Scene scene = orbitalScene(volume);
  scene.method = Method::automatic;
  return scene;
}

Choice chosen(const std::shared_ptr<const Volume>& volume, const Scene& scene) {
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(scene);
  return renderer->choice();
}

/// RMSE against the reference, over linear premultiplied RGBA, and the error that the renderer claims.
std::pair<double, double> errorAfter(int samples, const std::shared_ptr<const Volume>& volume,
                                     const Scene& scene) {
  const auto expected = reference::renderReference(*volume, scene, 1);
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(scene);
  for (int i = 0; i < samples; ++i) renderer->renderSample(kNever);
  const Image found = renderer->image();
  double squares = 0;
  for (std::size_t i = 0; i < found.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c)
      squares += std::pow(double(found.pixels[i][c]) - double(expected.image.pixels[i][c]), 2);
  return {std::sqrt(squares / (4.0 * double(found.pixels.size()))), renderer->estimatedError()};
}

/// The scene with a peak in the first channel's opacity; its width is a share of the range.
Scene withPeak(Scene scene, double width) {
  for (ChannelAppearance& channel : scene.channels) channel.visible = &channel == &scene.channels[0];
  scene.channels[0].opacity = {{0, 0}, {0.3 - width, 0}, {0.3, 1}, {0.3 + width, 0}, {1, 0}};
  return scene;
}

TEST(Automatic, TakesASmallerStepForFinerDetail) {
  const auto volume = orbitals();
  const Scene scene = automaticScene(*volume);
  const Choice coarse = chosen(volume, scene), fine = chosen(volume, withPeak(scene, 0.02));
  EXPECT_EQ(coarse.method, Method::raymarch);
  EXPECT_EQ(fine.method, Method::raymarch);
  EXPECT_LT(fine.step, coarse.step);
}

TEST(Automatic, DrawsMatterOfWhichOnlyTheSurfaceIsSeen) {
  // So dense that only the colour at its very surface is visible, and that changes within a voxel.
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  scene.filter = PixelFilter::point;
  scene.width = 16;
  scene.height = 12;
  for (ChannelAppearance& channel : scene.channels) {
    channel.density = 1e6;
    channel.opacity = {{0.2, 0}, {0.4, 1}};
    channel.color = {{0.2, {1, 0, 0}}, {0.22, {0, 1, 0}}, {0.4, {0, 0, 1}}};
  }
  const auto [found, claimed] = errorAfter(64, volume, scene);
  EXPECT_LT(found, 1e-5);
  EXPECT_LT(found, 2 * claimed + 1e-6);
}

TEST(Automatic, SeesTheAlphaOfDarkMatterOverABrightGround) {
  // All colours are those of soot, so no step has an error in them.
  const auto path = std::filesystem::path(SCOLOPAX_DATA_DIR) / "scalar/neghip_64x64x64_uint8.derived.raw";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the data set is absent from " << SCOLOPAX_DATA_DIR;
  const auto datasets =
      io::loadDatasets(std::vector{path}, io::defaultMemoryLimitBytes(), [](const std::string&) {});
  const auto volume = datasets.at(0).volume;
  for (const double soot : {0.0, 0.0052}) {  // sRGB #000000, #101010
    Scene scene;
    scene.width = scene.height = 32;
    scene.filter = PixelFilter::point;
    scene.camera = framingCamera(volume->grid(), 35, 1);
    scene.background = {1, 1, 1};
    scene.channels.resize(1);
    scene.channels[0].rangeLo = 30;
    scene.channels[0].rangeHi = 120;
    scene.channels[0].density = 0.15;
    scene.channels[0].color = {{0, glm::dvec3(soot)}};
    const auto expected = reference::renderReference(*volume, scene, 1).image;
    const auto renderer = makeCpuRenderer(volume, 2);
    renderer->setScene(scene);
    while (renderer->samples() < 2 || (renderer->estimatedError() > 0.001 && renderer->samples() < 4096))
      renderer->renderSample(kNever);
    const Image found = renderer->image();
    EXPECT_LT(compareImages(found, expected).rmse, 0.002) << soot;
    const Image8 shown = toSrgb8(found, scene.background), right = toSrgb8(expected, scene.background);
    double squares = 0;
    for (std::size_t i = 0; i < shown.rgb.size(); ++i)
      squares += std::pow(double(shown.rgb[i]) - double(right.rgb[i]), 2);
    EXPECT_LT(std::sqrt(squares / double(shown.rgb.size())), 2) << soot;  // levels
  }
}

TEST(Automatic, KnowsItsErrorInLightOnAFewVoxels) {
  // Four channels of noise on 4 x 2 x 4 voxels, shaded: highlights narrower than voxels.
  std::uint32_t state = 3;
  const auto noise = [&](int, int, int) { return (state = state * 1664525u + 1013904223u) >> 24; };
  const glm::ivec3 dims(4, 2, 4);
  double found = 0, claimed = 0;
  for (int round = 0; round < 6; ++round) {
    const auto volume =
        volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, noise), channelOf<std::uint8_t>(dims, noise),
                 channelOf<std::uint8_t>(dims, noise), channelOf<std::uint8_t>(dims, noise));
    Scene scene;
    scene.width = scene.height = 16;
    scene.filter = PixelFilter::point;
    scene.camera = framingCamera(volume->grid(), 35, 1);
    scene.channels.resize(4);
    for (std::size_t i = 0; i < 4; ++i) {
      scene.channels[i].rangeHi = 255;
      scene.channels[i].density = 0.8;
      scene.channels[i].color = {{0, glm::dvec3(i != 0, i != 1, i != 2)}};
    }
    scene.shading = true;
    const auto [one, estimate] = errorAfter(64, volume, scene);
    found += one * one / 6;
    claimed += estimate * estimate / 6;
  }
  EXPECT_LT(std::sqrt(found), 2 * std::sqrt(claimed) + 1e-4);
}

TEST(Automatic, WorksOutLightAtFewPlacesWhereThereAreShadows) {
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  scene.shading = true;
  EXPECT_EQ(chosen(volume, scene).method, Method::raymarch);
  scene.shadows = true;
  EXPECT_EQ(chosen(volume, scene).method, Method::hybrid);
}

TEST(Automatic, TriesNoStepsThatFacesOfNearestVoxelsCutAnyway) {
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  const auto launcher = makeCpuLauncher(0);
  const auto raysOf = [&] { return chooseAutomatically(*launcher, RenderPlan(volume, scene)).rays; };
  const std::uint64_t before = raysOf();
  for (ChannelAppearance& channel : scene.channels) channel.interpolation = Interpolation::nearest;
  EXPECT_LT(2 * raysOf(), before);
}

TEST(Automatic, DependsOnSceneAndDataAlone) {
  const auto volume = orbitals();
  const Scene scene = automaticScene(*volume);
  Scene large = scene;
  large.width *= 4;
  large.height *= 4;
  const Scene fine = withPeak(scene, 0.02);
  // The choice must not depend on earlier scenes of the renderer.
  const auto renderer = makeCpuRenderer(volume, 1);
  for (const Scene& before : {large, fine}) {
    renderer->setScene(before);
    renderer->setScene(scene);
    EXPECT_EQ(renderer->choice().step, chosen(volume, scene).step);
  }
  EXPECT_NE(chosen(volume, fine).step, chosen(volume, scene).step);
}

TEST(Automatic, LeavesAllAsItWasWhenItIsStoppedAndChoosesAnewTheNextTime) {
  const auto volume = orbitals();
  const Scene scene = automaticScene(*volume);
  Scene edited = scene;
  edited.channels[0].density *= 0.5;
  edited.width *= 2;
  std::stop_source stop;
  stop.request_stop();
  const auto renderer = makeCpuRenderer(volume, 1);
  renderer->setScene(scene);
  renderer->renderSample(kNever);
  const Choice before = renderer->choice();
  try {
    renderer->setScene(edited, stop.get_token());
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
  EXPECT_EQ(renderer->choice().method, before.method);
  EXPECT_EQ(renderer->choice().step, before.step);
  EXPECT_TRUE(renderer->renderSample(kNever));
  EXPECT_EQ(renderer->image().width, scene.width);
  EXPECT_EQ(renderer->samples(), 2u);
  EXPECT_FALSE(renderer->setScene(scene).filmReset);
  EXPECT_TRUE(renderer->setScene(edited).filmReset);
  EXPECT_EQ(renderer->choice().method, chosen(volume, edited).method);
  EXPECT_EQ(renderer->choice().step, chosen(volume, edited).step);
}

TEST(Automatic, ChoosesAnewAfterASceneThatSaidWhatWasChosenForAnother) {
  const auto volume = orbitals();
  const Scene smooth = automaticScene(*volume), sharp = withPeak(smooth, 0.02);
  const Choice ofSmooth = chosen(volume, smooth), ofSharp = chosen(volume, sharp);
  ASSERT_NE(ofSmooth.step, ofSharp.step);
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(smooth);
  Scene said = sharp;
  said.method = ofSmooth.method;
  said.step = ofSmooth.step;
  renderer->setScene(said);
  renderer->setScene(sharp);
  EXPECT_EQ(renderer->choice().method, ofSharp.method);
  EXPECT_EQ(renderer->choice().step, ofSharp.step);
}

TEST(Automatic, DrawsFirstWhatItsChoiceDraws) {
  const auto volume = orbitals();
  const Scene scene = automaticScene(*volume);
  Scene same = scene;
  const Choice choice = chosen(volume, scene);
  same.method = choice.method;
  same.step = choice.step;
  const auto a = makeCpuRenderer(volume, 2), b = makeCpuRenderer(volume, 1);
  a->setScene(scene);
  b->setScene(same);
  for (int i = 0; i < 3; ++i) {
    a->renderSample(kNever);
    b->renderSample(kNever);
  }
  const Image found = a->image(), expected = b->image();
  EXPECT_EQ(std::memcmp(found.pixels.data(), expected.pixels.data(), found.pixels.size() * sizeof(glm::vec4)),
            0);
}

TEST(Automatic, CountsItsBiasAsErrorFromTheFirstEstimateOn) {
  // Rays through pixel centres, cut at the faces of voxel cells, have no noise.
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  scene.filter = PixelFilter::point;
  const auto [found, claimed] = errorAfter(2, volume, scene);
  EXPECT_GT(found, 2e-6);
  EXPECT_LT(found, 2 * claimed);
}

TEST(Automatic, KeepsTheFilmUnlessItsChoiceChanges) {
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  const auto renderer = makeCpuRenderer(volume, 2);
  EXPECT_TRUE(renderer->setScene(scene).filmReset);
  renderer->renderSample(kNever);
  EXPECT_FALSE(renderer->setScene(scene).filmReset);
  scene.background = {1, 0, 0};
  EXPECT_FALSE(renderer->setScene(scene).filmReset);
  EXPECT_EQ(renderer->samples(), 1u);
  // A scene with the chosen method and step gives a picture without corrections.
  const Choice choice = renderer->choice();
  scene.method = choice.method;
  scene.step = choice.step;
  EXPECT_TRUE(renderer->setScene(scene).filmReset);
  EXPECT_EQ(renderer->samples(), 0u);
  scene.method = Method::automatic;
  EXPECT_TRUE(renderer->setScene(scene).filmReset);
}

/// A scene that needs all levels after few samples: its rays are the same in every sample.
Scene correctedScene(const Volume& volume) {
  Scene scene = automaticScene(volume);
  scene.filter = PixelFilter::point;
  return scene;
}

TEST(Automatic, FallsBelowTheBiasOfItsStep) {
  const auto volume = orbitals();
  Scene scene = correctedScene(*volume);
  const Image truth = reference::renderReference(*volume, scene, 1).image;
  const auto renderer = makeCpuRenderer(volume, 0);
  renderer->setScene(scene);
  for (int i = 0; i < 1024; ++i) renderer->renderSample(kNever);
  const Choice choice = renderer->choice();
  const double found = compareImages(renderer->image(), truth).rmse;
  ASSERT_GE(choice.corrections.size(), 2u);
  for (const Choice::Correction& level : choice.corrections) EXPECT_GT(level.passes, 0u);
  scene.method = choice.method;
  scene.step = choice.step;
  renderer->setScene(scene);
  for (int i = 0; i < 1024; ++i) renderer->renderSample(kNever);
  EXPECT_LT(found, compareImages(renderer->image(), truth).rmse / 10);
}

TEST(Automatic, CorrectsThePictureThatItsSamplesShow) {
  // The coarse picture of the first level is that of the samples; that of every other level is the fine
  // picture of the level before it.
  const auto volume = orbitals();
  const auto launcher = makeCpuLauncher(0);
  for (const double width : {0.0, 0.3, 0.05, 0.01, 1e-3})
    for (const bool box : {false, true}) {
      Scene scene = automaticScene(*volume);
      if (width > 0) scene = withPeak(scene, width);
      scene.filter = box ? PixelFilter::box : PixelFilter::point;
      const AutomaticChoice choice = chooseAutomatically(*launcher, RenderPlan(volume, scene));
      Resolution before = choice.resolution;
      for (const Level& level : choice.levels) {
        EXPECT_EQ(level.estimate.coarse, before) << width << box;
        before = level.estimate.fine;
      }
    }
}

TEST(Automatic, ConvergesToTheReferenceOnNoiseAndPeaks) {
  const glm::ivec3 dims(24, 24, 24);
  std::uint32_t state = 11;
  const auto noise = [&](int, int, int) { return (state = state * 1664525u + 1013904223u) >> 24; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, noise));
  for (const double width : {0.5, 0.01})
    for (const double density : {0.02, 0.3}) {
      Scene scene = frontScene(*volume, 24, 24);
      scene.filter = PixelFilter::point;
      scene.method = Method::automatic;
      scene.channels[0].rangeHi = 255;
      scene.channels[0].density = density;
      scene.channels[0].opacity = {{0.5 - width, 0}, {0.5, 1}, {0.5 + width, 0}};
      const Image truth = reference::renderReference(*volume, scene, 1).image;
      const auto renderer = makeCpuRenderer(volume, 0);
      renderer->setScene(scene);
      for (int i = 0; i < 256; ++i) renderer->renderSample(kNever);
      const double error = compareImages(renderer->image(), truth).rmse;
      EXPECT_LT(error, 2e-4) << width << ' ' << density;
      EXPECT_GT(3 * renderer->estimatedError() + 2e-5, error) << width << ' ' << density;
    }
}

TEST(Automatic, GivesTheSameBitsHoweverItsPassesAreInterrupted) {
  const auto volume = orbitals();
  const Scene scene = correctedScene(*volume);
  const auto whole = makeCpuRenderer(volume, 1), parts = makeCpuRenderer(volume, 2);
  whole->setScene(scene);
  parts->setScene(scene);
  const std::atomic<bool> always = true;
  int interruptions = 0;
  for (int i = 0; i < 64; ++i) {
    whole->renderSample(kNever);
    parts->renderSample(always);
    while (!parts->renderSample(kNever, std::chrono::microseconds(100))) ++interruptions;
  }
  EXPECT_GT(interruptions, 64);
  ASSERT_GT(whole->choice().corrections.size(), 0u);
  const Image found = parts->image(), expected = whole->image();
  EXPECT_EQ(std::memcmp(found.pixels.data(), expected.pixels.data(), found.pixels.size() * sizeof(glm::vec4)),
            0);
}

TEST(Automatic, GoesOnWithoutCorrectionsWhileThereIsNoMemoryForThem) {
  const auto volume = orbitals();
  const Scene scene = correctedScene(*volume);
  const auto unlimited = makeCpuRenderer(volume, 1);
  unlimited->setScene(scene);
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(64) << 20);
  const auto limited = makeCpuRenderer(volume, 1, memory);
  limited->setScene(scene);
  // Leaves memory for half of a level.
  const std::uint64_t pixels = std::uint64_t(scene.width) * std::uint64_t(scene.height);
  std::optional<MemoryBudget::Share> rest;
  rest = MemoryBudget::take(memory, MemoryUse::pictures);
  rest->resize(memory->limit() - memory->used(MemoryUse::films) - memory->used(MemoryUse::grids) -
               pixels * 16);
  for (int i = 0; i < 64; ++i) {
    unlimited->renderSample(kNever);
    EXPECT_TRUE(limited->renderSample(kNever));
  }
  EXPECT_GT(unlimited->choice().corrections.size(), 0u);
  EXPECT_EQ(limited->choice().corrections.size(), 0u);
  EXPECT_GT(limited->estimatedError(), unlimited->estimatedError());  // it includes the remaining bias
  rest.reset();
  for (int i = 0; i < 64; ++i) limited->renderSample(kNever);
  EXPECT_GT(limited->choice().corrections.size(), 0u);
  // A new film returns the memory of the corrections.
  const std::uint64_t used = memory->used(MemoryUse::films);
  Scene next = scene;
  next.seed = 1;
  limited->setScene(next);
  EXPECT_LT(memory->used(MemoryUse::films), used);
}

TEST(Automatic, WithoutAnythingToSeeDrawsNothing) {
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  for (ChannelAppearance& channel : scene.channels) channel.visible = false;
  scene.shading = scene.shadows = true;
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(scene);
  for (int i = 0; i < 16; ++i) renderer->renderSample(kNever);
  EXPECT_EQ(renderer->estimatedError(), 0);
  for (const glm::vec4& pixel : renderer->image().pixels) EXPECT_EQ(pixel, glm::vec4(0));
}

}  // namespace
}  // namespace scolopax
