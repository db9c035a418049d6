// SPDX-License-Identifier: Apache-2.0
// The CUDA launcher against a runtime that fails, runs out of memory and loses devices on request.
#include "cuda/cuda_launcher.h"

#include "renderer/core/error.h"
#include "tests/cuda/launcher_fixture.h"

namespace scolopax {
namespace {

using namespace test;

TEST_F(CudaLauncher, HasNoDevicesWhenTheDriverIsMissingOrTooOld) {
  ASSERT_EQ(cuda::devices().size(), 1u);
  EXPECT_EQ(cuda::devices()[0].index, 0);
  EXPECT_GT(cuda::devices()[0].memoryBytes, 0u);
  substitute::setDeviceCount(cudaErrorInsufficientDriver, 7);
  std::string why;
  EXPECT_TRUE(cuda::devices(&why).empty());
  EXPECT_FALSE(why.empty());
  EXPECT_EQ(cudaGetLastError(), cudaSuccess);
}

// Whichever call fails, one of two things happens: the device fails as a whole and the CPU makes the picture,
// or it is an error of memory and the next attempt succeeds.
TEST_F(CudaLauncher, GoesOnOnTheCpuWhicheverCallFails) {
  const auto volume = mixedVolume();
  const Scene scene = smallScene(*volume);
  const Image expected = pictureOfTheCpu(volume, scene);
  const auto attempt = [&](std::size_t call) {
    int lines = 0;
    std::unique_ptr<Renderer> renderer;
    try {
      renderer = makeRenderer(
          cuda::makeCudaLauncher(cuda::openDevices({0}), 1,
                                 {.continueOnCpu = true, .log = [&](const std::string&) { ++lines; }}),
          volume);
    } catch (const Error&) {
      return false;  // failed before there was a renderer
    }
    substitute::failCall(call, cudaErrorIllegalAddress);
    const std::size_t before = substitute::callCount();
    expectSamePicture(rendered(*renderer, scene), expected);
    const bool failed = renderer->backendName() == "cpu";
    EXPECT_EQ(lines, failed ? 1 : 0);
    EXPECT_EQ(failed, substitute::callCount() - before >= call) << call;
    substitute::failCall(0, cudaSuccess);
    return failed;
  };
  std::size_t call = 1;
  while (attempt(call)) ++call;
  EXPECT_GT(call, 30u);
}

TEST_F(CudaLauncher, LeavesADeviceAloneThatHasFailedForAnotherSession) {
  const auto volume = mixedVolume();
  const Scene scene = smallScene(*volume);
  const Image expected = pictureOfTheCpu(volume, scene);
  const auto devices = cuda::openDevices({0});
  int lines = 0;
  const auto make = [&] {
    return makeRenderer(cuda::makeCudaLauncher(
                            devices, 1, {.continueOnCpu = true, .log = [&](const std::string&) { ++lines; }}),
                        volume);
  };
  const auto first = make(), second = make();
  substitute::failCall(1, cudaErrorIllegalAddress);
  expectSamePicture(rendered(*first, scene), expected);
  const auto third = make();
  const std::size_t calls = substitute::callCount();
  for (Renderer* other : {second.get(), third.get()}) {
    EXPECT_EQ(other->backendName(), "cpu");
    expectSamePicture(rendered(*other, scene), expected);
  }
  EXPECT_EQ(substitute::callCount(), calls);
  EXPECT_EQ(lines, 1);
}

TEST_F(CudaLauncher, EndsInWordsWhenADeviceIsLostIfThatIsWanted) {
  const auto volume = mixedVolume();
  const Scene scene = smallScene(*volume);
  const auto renderer = makeCudaRenderer(volume);
  rendered(*renderer, scene, 1);
  substitute::loseDevice(0);
  for (int i = 0; i < 2; ++i) {
    try {
      renderer->renderSample(kNever);
      ADD_FAILURE() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::device);
      EXPECT_EQ(std::string(error.what()).substr(0, 6), "CUDA: ");
    }
  }
}

TEST_F(CudaLauncher, ReportsWhatAKernelDidWrong) {
  const auto volume = mixedVolume();
  const auto renderer = makeCudaRenderer(volume);
  renderer->setScene(smallScene(*volume));
  substitute::reportFault("as a test");
  try {
    renderer->renderSample(kNever);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::device);
  }
}

TEST_F(CudaLauncher, UploadsAVolumeOnceAndOnlyChannelsThatAreVisible) {
  const glm::ivec3 dims(64);
  const auto wave = [&] {
    return volumeOf(gridOf(dims),
                    channelOf<std::uint8_t>(dims, [](int x, int y, int z) { return 90 + x + y - z; }),
                    channelOf<std::uint8_t>(dims, [](int x, int y, int z) { return 100 + x - y + z; }));
  };
  const auto volume = wave(), otherVolume = wave();
  const std::size_t plane = 64 * 64 * 64;
  Scene scene = obliqueScene(*volume, 16, 16);
  scene.channels[1].visible = false;
  const auto devices = cuda::openDevices({0});
  const auto first = makeCudaRenderer(volume, devices), second = makeCudaRenderer(volume, devices);
  auto moved = [before = std::size_t(0)]() mutable {
    return substitute::bytesToDevice() - std::exchange(before, substitute::bytesToDevice());
  };
  moved();
  EXPECT_TRUE(first->takesLong(scene));
  rendered(*first, scene, 1);
  const std::size_t once = moved();
  EXPECT_GE(once, plane);
  EXPECT_LT(once, 2 * plane);
  rendered(*second, scene, 1);
  EXPECT_LT(moved(), plane);
  scene.channels[1].visible = true;
  EXPECT_TRUE(second->takesLong(scene));
  rendered(*second, scene, 1);
  EXPECT_GE(moved(), plane);
  // A channel of which nothing is visible is not needed.
  const auto third = makeCudaRenderer(otherVolume, devices);
  Scene transparent = scene;
  transparent.channels[1].opacity = {{0, 0}};
  rendered(*third, transparent, 1);
  transparent.camera.eye.x += 1;
  EXPECT_FALSE(third->takesLong(transparent));
  transparent.channels[1].opacity = {{0, 1}};
  EXPECT_TRUE(third->takesLong(transparent));
  moved();
  // Only the camera changes.
  scene.camera.eye.x += 1;
  EXPECT_FALSE(second->takesLong(scene));
  rendered(*second, scene, 1);
  EXPECT_LT(moved(), 4096u);
}

TEST_F(CudaLauncher, MovesLessThan100KilobytesForAnEditOfACurve) {
  const glm::ivec3 dims(256);
  const auto channel = [&](int shift) {
    return channelOf<std::uint8_t>(dims, [&](int x, int y, int z) { return (x + y * shift + z) >> 2; });
  };
  const auto volume = volumeOf(gridOf(dims), channel(1), channel(2), channel(0), channel(1));
  Scene scene = obliqueScene(*volume, 16, 16);
  scene.channels[3].visible = true;
  const auto renderer = makeCudaRenderer(volume);
  rendered(*renderer, scene, 1);
  const std::size_t before = substitute::bytesToDevice();
  scene.channels[2].opacity = {{0.2, 0}, {0.5, 0.9}, {1, 0.1}};
  scene.channels[2].density = 2;
  renderer->setScene(scene);
  EXPECT_LT(substitute::bytesToDevice() - before, 100'000u);
  ASSERT_TRUE(renderer->renderSample(kNever));
  EXPECT_LT(substitute::bytesToDevice() - before, 100'000u);
  expectSamePicture(renderer->image(), pictureOfTheCpu(volume, scene, 1));
}

TEST_F(CudaLauncher, ContinuesWhereACancelledPassEnded) {
  const auto volume = mixedVolume();
  const Scene scene = obliqueScene(*volume, 40, 60);
  const auto renderer = makeCudaRenderer(volume);
  renderer->setScene(scene);
  const std::atomic<bool> cancelled{true};
  EXPECT_FALSE(renderer->renderSample(cancelled));
  EXPECT_EQ(renderer->samples(), 0u);
  int slices = 1;
  while (!renderer->renderSample(kNever, std::chrono::nanoseconds(1)) && slices < 100) ++slices;
  // A pass without time left renders nothing.
  EXPECT_EQ(slices, 100);
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(renderer->renderSample(kNever));
  expectSamePicture(renderer->image(), pictureOfTheCpu(volume, scene));
}

TEST_F(CudaLauncher, DividesAPictureAmongDevices) {
  substitute::setDeviceCount(cudaSuccess, 3);
  ASSERT_EQ(cuda::devices().size(), 3u);
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 600, 300);  // more than one band each
  scene.channels[0].density = scene.channels[1].density = 0.05;
  const auto renderer = makeCudaRenderer(volume, cuda::openDevices({0, 2}));
  renderer->recordAovs();
  expectSamePicture(rendered(*renderer, scene, 1), pictureOfTheCpu(volume, scene, 1));
  int on[3] = {};
  for (const substitute::Allocation& allocation : substitute::allocations()) ++on[allocation.device];
  EXPECT_GT(on[0], 0);
  EXPECT_EQ(on[1], 0);
  EXPECT_GT(on[2], 0);
}

}  // namespace
}  // namespace scolopax
