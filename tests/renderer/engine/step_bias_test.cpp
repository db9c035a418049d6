// SPDX-License-Identifier: Apache-2.0
// Limits on small pictures of a scene: they stop when cancelled, their steps are no finer than a ray allows,
// and they take no more than a certain amount of work.
#include "renderer/engine/step_bias.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "renderer/core/error.h"
#include "renderer/engine/pilot.h"
#include "renderer/renderer.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;
using namespace std::chrono_literals;

/// Noise, 3000 voxels deep.
std::shared_ptr<const Volume> deepVolume() {
  const glm::ivec3 dims(4, 4, 3000);
  const auto value = [](int x, int y, int z) { return (x * 89 + y * 57 + z * 131) % 256; };
  const auto channel = [&] { return channelOf<std::uint8_t>(dims, value); };
  return volumeOf(gridOf(dims), channel(), channel());
}

/// A view along the whole depth of the volume, which takes minutes to march.
Scene slowScene(const Volume& volume) {
  Scene scene = frontScene(volume, 16, 16);
  for (ChannelAppearance& channel : scene.channels) channel.density = 1e-4;
  scene.method = Method::raymarch;
  scene.blend = BlendMode::max;
  scene.step = 0.01;
  scene.shading = scene.shadows = true;
  scene.lights.assign(8, {});
  return scene;
}

/// Whether the work ends at once, with Error(cancelled).
template <class Work>
void expectToEndWhenStopped(Work work) {
  std::stop_source stop;
  std::chrono::steady_clock::time_point requested;
  std::jthread other([&] {
    std::this_thread::sleep_for(50ms);
    requested = std::chrono::steady_clock::now();
    stop.request_stop();
  });
  try {
    work(stop.get_token());
    ADD_FAILURE() << "was not stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
  other.join();
  EXPECT_LT(std::chrono::steady_clock::now() - requested, 30s);
}

TEST(StepBias, EndsSoonAfterAStopIsRequested) {
  const auto volume = deepVolume();
  const auto launcher = makeCpuLauncher(0);
  const RenderPlan plan(volume, slowScene(*volume));
  expectToEndWhenStopped([&](const std::stop_token& stop) { estimateBias(*launcher, plan, stop); });
  expectToEndWhenStopped([&](const std::stop_token& stop) { chooseAutomatically(*launcher, plan, stop); });
}

TEST(Automatic, ChoosesForAGridOnWhichEveryStepIsTooSmall) {
  const glm::ivec3 dims(2, 2, 64);
  const auto value = [](int x, int y, int z) { return (x * 89 + y * 57 + z * 131) % 256; };
  const auto volume = volumeOf(gridOf(dims, {1e-6, 1e-6, 1}), channelOf<std::uint8_t>(dims, value));
  const auto launcher = makeCpuLauncher(0);
  const RenderPlan plan(volume, frontScene(*volume, 16, 16));
  const AutomaticChoice choice = chooseAutomatically(*launcher, plan);
  EXPECT_TRUE(choice.method == Method::superposed || choice.resolution.voxelwise);
}

TEST(StepBias, MarchesNoFinerThanTheSmallestStepOfARay) {
  // 2^16 steps of 0.046 are as long as the diagonal.
  const glm::ivec3 dims(3000, 4, 4);
  const auto value = [](int x, int y, int z) { return (x * 89 + y * 57 + z * 131) % 256; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, value));
  Scene scene = frontScene(*volume, 24, 24);
  scene.method = Method::raymarch;
  scene.channels[0].rangeHi = 255;
  scene.height = 1;
  scene.camera.orthoHeight = 4;
  const auto launcher = makeCpuLauncher(0);
  const auto biasAt = [&](double step) {
    scene.step = step;
    const RenderPlan plan(volume, scene);
    return estimateBias(*launcher, plan);
  };
  EXPECT_GT(biasAt(0.01), 0);
  EXPECT_EQ(biasAt(0.01), biasAt(0.04));
  EXPECT_LT(biasAt(0.04), biasAt(2));
}

/// Says that every ray takes so much work, but does none: all pixels are equal.
class CostlyLauncher : public Launcher {
 public:
  CostlyLauncher(std::uint32_t workOfRay, std::uint64_t* work) : workOfRay_(workOfRay), work_(work) {}
  std::string_view name() const override { return "costly"; }
  void run(const std::function<void()>& f) override { f(); }
  void upload(const std::shared_ptr<const RenderPlan>&, const std::stop_token&) override {}
  bool uploadTakesLong(const RenderPlan&, const Scene&) const override { return false; }
  bool launch(const Pass& pass) override {
    for (int i = 0; i < pass.scene.width * pass.scene.height; ++i) {
      if (pass.done[i]) continue;
      pass.done[i] = 1;
      pass.pixels[i] = glm::vec4(0.5f);
      if (!pass.cost) continue;
      pass.cost[i].fetches += workOfRay_ / 4;
      pass.cost[i].cellSteps += workOfRay_ - workOfRay_ / 4;
      *work_ += workOfRay_;
    }
    return true;
  }

 private:
  const std::uint32_t workOfRay_;
  std::uint64_t* const work_;
};

/// Work of a ray of which a thousand are too many, and that of the four rows that are rendered at once.
constexpr std::uint32_t kMuch = 1 << 24;
constexpr std::uint64_t kMuchAtOnce = 4 * 24 * std::uint64_t(kMuch);

std::shared_ptr<const Volume> fewVoxels() {
  const glm::ivec3 dims(4, 4, 4);
  return volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) { return x + y + z; }));
}

TEST(StepBias, IsNotKnownWhereItTakesTooMuchWork) {
  const auto volume = fewVoxels();
  Scene scene = frontScene(*volume, 100, 100);
  scene.method = Method::raymarch;
  const RenderPlan plan(volume, scene);
  std::uint64_t little = 0, much = 0;
  CostlyLauncher cheap(1 << 10, &little), costly(kMuch, &much);
  EXPECT_EQ(estimateBias(cheap, plan), 0);
  EXPECT_EQ(little, 3 * 8 * 24 * 24 * std::uint64_t(1 << 10));
  EXPECT_TRUE(std::isnan(estimateBias(costly, plan)));
  EXPECT_GT(much, kMostBiasWork);
  EXPECT_LE(much, kMostBiasWork + kMuchAtOnce);
}

TEST(Automatic, TakesTheTrackerWhereItsChoiceTakesTooMuchWork) {
  const auto volume = fewVoxels();
  const RenderPlan plan(volume, frontScene(*volume, 100, 100));
  std::uint64_t much = 0;
  CostlyLauncher costly(kMuch, &much);
  EXPECT_EQ(chooseAutomatically(costly, plan).method, Method::superposed);
  EXPECT_GT(much, kMostChoiceWork);
  EXPECT_LE(much, kMostChoiceWork + kMuchAtOnce);
}

TEST(Renderer, DoesNotKnowTheErrorOfAPictureWhoseBiasTakesTooMuchWork) {
  const auto volume = fewVoxels();
  std::uint64_t much = 0;
  const auto renderer = makeRenderer(std::make_unique<CostlyLauncher>(kMuch, &much), volume);
  Scene scene = frontScene(*volume, 100, 100);
  scene.method = Method::raymarch;
  renderer->setScene(scene);
  while (renderer->samples() < 15) renderer->renderSample(kNever);
  EXPECT_EQ(renderer->estimatedError(), 0);
  renderer->renderSample(kNever);
  EXPECT_TRUE(renderer->errorTakesLong());
  EXPECT_TRUE(std::isnan(renderer->estimatedError()));
  EXPECT_FALSE(renderer->errorTakesLong());
  EXPECT_TRUE(std::isnan(renderer->estimatedError()));
  scene.method = Method::automatic;
  renderer->setScene(scene);
  EXPECT_EQ(renderer->choice().method, Method::superposed);
  while (renderer->samples() < 16) renderer->renderSample(kNever);
  EXPECT_EQ(renderer->estimatedError(), 0);
}

}  // namespace
}  // namespace scolopax
