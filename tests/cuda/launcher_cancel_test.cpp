// SPDX-License-Identifier: Apache-2.0
// Passes that are cancelled while a kernel runs.
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "cuda/cancel_watch.h"
#include "tests/cuda/launcher_fixture.h"
#include "tests/cuda/ptx_machine.h"

namespace scolopax {
namespace {

using namespace test;
using Flag = std::atomic<bool>;

/// Waits until a flag is set; not for ever, so that a test can fail.
template <class IsSet>
bool isSetSoon(IsSet&& isSet) {
  const auto latest = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!isSet() && std::chrono::steady_clock::now() < latest) std::this_thread::yield();
  return isSet();
}

/// The flags that bands show to kernels.
std::vector<const Flag*> flagsOfBands() {
  std::vector<const Flag*> flags;
  for (const substitute::Allocation& allocation : substitute::mappedAllocations())
    flags.push_back(reinterpret_cast<const Flag*>(allocation.begin));
  return flags;
}

Scene marchedScene(const Volume& volume) {
  Scene scene = obliqueScene(volume, 40, 60);
  scene.method = Method::raymarch;
  scene.step = 0.05;
  for (ChannelAppearance& channel : scene.channels) channel.density *= 0.05;
  return scene;
}

TEST_F(CudaLauncher, EndsTheKernelOfACancelledPassWhileItRunsAndRendersItsRowsAgain) {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const auto volume = mixedVolume();
  const Scene scene = marchedScene(*volume);
  const auto renderer = makeCudaRenderer(volume);
  std::uint64_t before = ptx::clockReadings;
  rendered(*renderer, scene, 1);
  [[maybe_unused]] const std::uint64_t readingsOfAPass = ptx::clockReadings - before;

  const std::vector<const Flag*> flags = flagsOfBands();
  ASSERT_FALSE(flags.empty());
  Flag cancel = false;
  bool told = false;
  // The kernel goes on meanwhile: blocks of a device run at the same time.
  substitute::callBeforeBlock(3, [&] {
    cancel = true;
    told =
        isSetSoon([&] { return std::ranges::any_of(flags, [](const Flag* flag) { return bool(*flag); }); });
    before = ptx::clockReadings;
  });
  EXPECT_FALSE(renderer->renderSample(cancel));
  EXPECT_TRUE(told);
  EXPECT_EQ(renderer->samples(), 1u);
#if !defined(SCOLOPAX_HOST_KERNELS)
  EXPECT_GT(readingsOfAPass, 100'000u);
  EXPECT_LT(ptx::clockReadings - before, 20'000u) << "a few times by each ray that had not ended";
#endif

  cancel = false;
  EXPECT_TRUE(renderer->renderSample(cancel));
  expectSamePicture(renderer->image(), pictureOfTheCpu(volume, scene));
}

TEST_F(CudaLauncher, EndsRaysWithManyCollisionsWhenTheirPassIsCancelled) {
  const glm::ivec3 dims(32);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) {
                                 return (x + y + z) % 7 == 0 ? 255 : 0;
                               }));
  Scene scene = frontScene(*volume, 64, 64);
  scene.channels[0].rangeLo = 254;
  scene.channels[0].rangeHi = 255;
  scene.channels[0].density = 1e6;
  for (const Method method : {Method::superposed, Method::syncDda}) {
    scene.method = method;
    const auto renderer = makeCudaRenderer(volume);
    renderer->setScene(scene);
    Flag cancel = false;
    substitute::callBeforeBlock(1, [&] { cancel = true; });
    EXPECT_FALSE(renderer->renderSample(cancel));
    EXPECT_EQ(renderer->samples(), 0u);
  }
}

TEST(CancelWatch, SetsAFlagOnlyAfterTheOtherAndWhileThePairIsWatched) {
  cuda::CancelWatch watch;
  Flag from = false, to = false, removed = false, last = false;
  watch.add(from, to);
  watch.add(from, removed);
  EXPECT_FALSE(to);
  watch.remove(removed);
  from = true;
  EXPECT_TRUE(isSetSoon([&] { return bool(to); }));
  watch.add(from, last);
  EXPECT_TRUE(isSetSoon([&] { return bool(last); }));
  EXPECT_FALSE(removed);
}

}  // namespace
}  // namespace scolopax
