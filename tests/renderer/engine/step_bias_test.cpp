// SPDX-License-Identifier: Apache-2.0
// Limits on small pictures of a scene: they stop when cancelled, and their steps are no finer than a ray
// allows.
#include "renderer/engine/step_bias.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "renderer/core/error.h"
#include "renderer/engine/pilot.h"
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

}  // namespace
}  // namespace scolopax
