// SPDX-License-Identifier: Apache-2.0
// The CPU backend's choice of a method for scenes with the method `auto`.
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "renderer/core/error.h"
#include "renderer/renderer.h"
#include "tests/support/orbitals.h"

namespace scolopax {
namespace {

using namespace test;

const std::atomic<bool> kNever = false;

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

TEST(Automatic, TakesASmallerStepForASmallerError) {
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  double last = 100;
  for (const double target : {5e-2, 4e-3, 2e-4}) {
    scene.targetError = target;
    const Choice choice = chosen(volume, scene);
    EXPECT_EQ(choice.method, Method::raymarch);
    EXPECT_LT(choice.step, last);
    last = choice.step;
  }
}

TEST(Automatic, LeavesToTheTrackerWhatNoStepCanDo) {
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  scene.targetError = 1e-9;
  EXPECT_EQ(chosen(volume, scene).method, Method::superposed);
}

TEST(Automatic, WorksOutLightAtFewPlacesWhereThereAreShadows) {
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  scene.shading = true;
  EXPECT_EQ(chosen(volume, scene).method, Method::raymarch);
  scene.shadows = true;
  EXPECT_EQ(chosen(volume, scene).method, Method::hybrid);
}

TEST(Automatic, DependsOnSceneAndDataAlone) {
  const auto volume = orbitals();
  const Scene scene = automaticScene(*volume);
  Scene large = scene;
  large.width *= 4;
  large.height *= 4;
  Scene fine = scene;
  fine.targetError = 1e-4;
  // The choice must not depend on earlier scenes of the renderer.
  const auto renderer = makeCpuRenderer(volume, 1);
  for (const Scene& before : {large, fine}) {
    renderer->setScene(before);
    renderer->setScene(scene);
    EXPECT_EQ(renderer->choice().step, chosen(volume, scene).step);
  }
  EXPECT_EQ(chosen(volume, large).step, chosen(volume, scene).step);
  EXPECT_LT(chosen(volume, fine).step, chosen(volume, scene).step);
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
  const Scene sharp = automaticScene(*volume);
  Scene smooth = sharp;
  for (ChannelAppearance& channel : smooth.channels) channel.density = 0.005;
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

TEST(Automatic, DrawsWhatItsChoiceDraws) {
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
  const auto volume = orbitals();
  Scene scene = automaticScene(*volume);
  scene.filter = PixelFilter::point;
  const auto renderer = makeCpuRenderer(volume, 2);
  renderer->setScene(scene);
  for (int i = 0; i < 2; ++i) renderer->renderSample(kNever);
  const double found = renderer->estimatedError();
  scene.method = renderer->choice().method;
  scene.step = renderer->choice().step;
  renderer->setScene(scene);
  for (int i = 0; i < 2; ++i) renderer->renderSample(kNever);
  EXPECT_GT(found, renderer->estimatedError());  // the renderer's estimate includes only noise
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
  scene.targetError *= 1.01;
  EXPECT_FALSE(renderer->setScene(scene).filmReset);
  EXPECT_EQ(renderer->samples(), 1u);
  scene.targetError = 1e-5;
  EXPECT_TRUE(renderer->setScene(scene).filmReset);
  EXPECT_EQ(renderer->samples(), 0u);
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
