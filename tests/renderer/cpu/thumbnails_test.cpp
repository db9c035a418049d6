// SPDX-License-Identifier: Apache-2.0
// How long small pictures of a scene may take: until nobody waits for them, and no finer than a ray can be.
#include "renderer/cpu/thumbnails.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "renderer/core/error.h"
#include "tests/support/orbitals.h"

namespace scolopax {
namespace {

using namespace test;
using namespace std::chrono_literals;

/// Thumbnails of it take minutes.
Scene endlessScene(const Volume& volume) {
  Scene scene = orbitalScene(volume);
  scene.method = Method::raymarch;
  scene.step = 0.002;
  scene.shading = scene.shadows = true;
  scene.lights.assign(8, {});
  return scene;
}

/// Whether the work ends as cancelled, long before it would have been done.
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
  EXPECT_LT(std::chrono::steady_clock::now() - requested, 5s);
}

TEST(Thumbnails, EndSoonAfterAStopIsRequested) {
  const auto volume = orbitals();
  RenderPlan plan(volume);
  plan.update(endlessScene(*volume));
  expectToEndWhenStopped([&](const std::stop_token& stop) { estimateBias(plan, stop); });
  expectToEndWhenStopped([&](const std::stop_token& stop) {
    while (true) largestStep(plan, Method::raymarch, 1e-9, stop);
  });
}

TEST(Thumbnails, MarchNoFinerThanTheSmallestStepOfARay) {
  // 2^16 steps of 0.046 are as long as the diagonal.
  const glm::ivec3 dims(3000, 4, 4);
  const auto value = [](int x, int y, int z) { return (x * 89 + y * 57 + z * 131) % 256; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, value));
  Scene scene = frontScene(*volume, 24, 24);
  scene.method = Method::raymarch;
  const auto biasAt = [&](double step) {
    scene.step = step;
    RenderPlan plan(volume);
    plan.update(scene);
    return estimateBias(plan);
  };
  EXPECT_GT(biasAt(0.01), 0);
  EXPECT_EQ(biasAt(0.01), biasAt(0.04));
  EXPECT_LT(biasAt(0.04), biasAt(0.5));
}

}  // namespace
}  // namespace scolopax
