// SPDX-License-Identifier: Apache-2.0
// The launcher against a runtime that fails on request.
#include "cuda/launch.h"

#include <gtest/gtest.h>

#include "renderer/core/error.h"
#include "tests/cuda/device_scenes.h"
#include "tests/cuda/substitute_runtime.h"

namespace scolopax {
namespace {

using namespace test;

TEST(Devices, AreNoneWhenTheDriverIsMissingOrTooOld) {
  EXPECT_EQ(cuda::deviceCount(), 1);
  substitute::setDeviceCount(cudaErrorInsufficientDriver, 7);
  EXPECT_EQ(cuda::deviceCount(), 0);
  EXPECT_EQ(cudaGetLastError(), cudaSuccess);
  substitute::setDeviceCount(cudaSuccess, 1);
}

TEST(Passes, GiveTheirMemoryBack) {
  renderOnDevice(mixedVolume(), obliqueScene(*mixedVolume(), 8, 8), 1);
  EXPECT_TRUE(substitute::allocations().empty());
}

TEST(Passes, ThatDoNotFitTheDeviceSaySoAndLeaveNothingBehind) {
  const auto volume = mixedVolume();
  const Scene scene = obliqueScene(*volume, 64, 64);
  // Every allocation in turn is the one that fails.
  bool fits = false;
  int failures = 0;
  for (std::size_t limit = 0; !fits; limit += 2048) {
    substitute::limitMemory(limit);
    try {
      renderOnDevice(volume, scene, 1);
      fits = true;
    } catch (const Error& error) {
      ++failures;
      EXPECT_EQ(error.code(), ErrorCode::tooLarge);
      EXPECT_STREQ(error.what(), "CUDA: allocating device memory failed: out of memory");
    }
    EXPECT_TRUE(substitute::allocations().empty());
  }
  EXPECT_GT(failures, 10);
  substitute::limitMemory(std::size_t(1) << 32);
}

TEST(Passes, ReportWhatAKernelDidWrong) {
  const auto volume = mixedVolume();
  const Scene scene = obliqueScene(*volume, 8, 8);
  const RenderPlan plan(volume, scene);
  cuda::Passes passes(scene, plan.view(), false);
  std::vector<glm::vec4> pixels(64);
  substitute::reportFault("as a test");
  try {
    passes.render(sampleNumber(scene.sampling, 0), pixels);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::device);
    EXPECT_EQ(std::string(error.what()).substr(0, 23), "CUDA: rendering failed:");
  }
  passes.render(sampleNumber(scene.sampling, 0), pixels);
}

TEST(DeviceBuffer, MovesItsMemoryAndFreesItOnce) {
  {
    const std::vector<int> numbers{1, 2, 3};
    cuda::DeviceBuffer<int> first{std::span(numbers)};
    cuda::DeviceBuffer<int> second(std::move(first));
    EXPECT_EQ(first.data(), nullptr);
    cuda::DeviceBuffer<int> third(5);
    third = std::move(second);
    EXPECT_EQ(third.count(), 3u);
    std::vector<int> back(3);
    third.copyTo(back);
    EXPECT_EQ(back, numbers);
    EXPECT_EQ(cuda::DeviceBuffer<int>(0).data(), nullptr);
  }
  EXPECT_TRUE(substitute::allocations().empty());
}

}  // namespace
}  // namespace scolopax
