// SPDX-License-Identifier: Apache-2.0
// The memory of a CUDA device that several sessions share: who may hold it, and who waits for whom.
#include <chrono>
#include <future>
#include <string>
#include <thread>
#include <utility>

#include "cuda/device_volume.h"
#include "cuda/fair_mutex.h"
#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "tests/cuda/launcher_fixture.h"

namespace scolopax {
namespace {

using namespace test;

constexpr glm::ivec3 kDims(160);  // 4 MiB per channel
constexpr std::size_t kMiB = 1 << 20;

ChannelSource channel(int seed) {
  return channelOf<std::uint8_t>(kDims, [&](int x, int y, int z) { return (x * y + z + seed) % 251; });
}

/// Bytes in all allocations of device memory.
std::size_t allocated() {
  std::size_t bytes = 0;
  for (const substitute::Allocation& allocation : substitute::allocations()) bytes += allocation.sizeBytes;
  return bytes;
}

/// The error with which a scene is refused.
Error refusal(Renderer& renderer, const Scene& scene) {
  try {
    rendered(renderer, scene, 1);
  } catch (const Error& error) {
    return error;
  }
  return {ErrorCode::io, "no error"};
}

TEST_F(CudaLauncher, ThatDoesNotFitTheDeviceSaysSoAndRendersOnceThereIsMemory) {
  const auto volume = mixedVolume();
  const Scene scene = obliqueScene(*volume, 24, 24);
  const Image expected = pictureOfTheCpu(volume, scene);
  int failures = 0;
  bool fits = false;
  // Each allocation in turn fails first.
  for (std::size_t limit = 0; !fits; limit += 16384) {
    const auto renderer = makeCudaRenderer(volume);
    substitute::limitMemory(limit);
    try {
      rendered(*renderer, scene);
      fits = true;
    } catch (const Error& error) {
      ++failures;
      EXPECT_EQ(error.code(), ErrorCode::tooLarge);
      EXPECT_STREQ(error.what(), limit == 0 ? "memory of a CUDA device: expected at most 0 MiB, found 1 MiB"
                                            : "CUDA: allocating device memory failed: out of memory");
      substitute::limitMemory(std::size_t(1) << 32);
      expectSamePicture(rendered(*renderer, scene), expected);
    }
  }
  EXPECT_GT(failures, 5);
}

TEST_F(CudaLauncher, OfAnotherSessionIsUnharmedWhenMemoryIsShort) {
  const auto volume = mixedVolume();
  const Scene scene = smallScene(*volume);
  const auto devices = cuda::openDevices({0});
  const auto first = makeCudaRenderer(volume, devices), second = makeCudaRenderer(volume, devices);
  rendered(*first, scene, 1);
  substitute::limitMemory(0);
  EXPECT_THROW(rendered(*second, obliqueScene(*volume, 16, 24), 1), Error);
  ASSERT_TRUE(first->renderSample(kNever));
  expectSamePicture(first->image(), pictureOfTheCpu(volume, scene));
}

TEST_F(CudaLauncher, MakesRoomByForgettingVolumesThatNobodyRenders) {
  const auto devices = cuda::openDevices({0});
  substitute::limitMemory(std::size_t{12}
                          << 20);  // with bands and macrocells, for one volume but not for two
  for (int i = 0; i < 3; ++i) {
    const auto each = volumeOf(gridOf(kDims), channel(i));
    Scene scene = obliqueScene(*each, 16, 16);
    const auto renderer = makeCudaRenderer(each, devices);
    expectSamePicture(rendered(*renderer, scene), pictureOfTheCpu(each, scene));
  }
}

TEST_F(CudaLauncher, KeepsNoVoxelsInTheMemoryOfTheHost) {
  auto volume = mixedVolume();
  const std::weak_ptr<const Volume> held = volume;
  const Scene scene = smallScene(*volume);
  const auto devices = cuda::openDevices({0});
  rendered(*makeCudaRenderer(volume, devices), scene, 1);
  volume.reset();
  EXPECT_TRUE(held.expired()) << "though its channels stay on the device while there is memory";
  const auto again = mixedVolume();
  expectSamePicture(rendered(*makeCudaRenderer(again, devices), scene), pictureOfTheCpu(again, scene));
}

TEST_F(CudaLauncher, ForgetsHiddenChannelsWhenMemoryIsShort) {
  const auto volume = volumeOf(gridOf(kDims), channel(0), channel(1), channel(2));
  Scene scene = obliqueScene(*volume, 16, 16);
  const auto show = [&](std::size_t shown) {
    for (std::size_t n = 0; n < scene.channels.size(); ++n) scene.channels[n].visible = n == shown;
  };
  // There is room for the channel that was hidden last beside the next one, or not even for that.
  for (const std::size_t room : {7 * kMiB, 3 * kMiB}) {
    const auto renderer = makeCudaRenderer(volume);
    show(0);
    rendered(*renderer, scene, 1);
    substitute::limitMemory(allocated() + room);
    for (const std::size_t shown : {1, 2, 0, 1}) {
      show(shown);
      expectSamePicture(rendered(*renderer, scene, 1), pictureOfTheCpu(volume, scene, 1));
    }
    substitute::limitMemory(std::size_t(1) << 32);
  }
}

TEST_F(CudaLauncher, HasMemoryReleasedBeforeItRefusesAScene) {
  const auto one = volumeOf(gridOf(kDims), channel(0)), other = volumeOf(gridOf(kDims), channel(1));
  std::unique_ptr<Renderer> parked;
  int asked = 0;
  const auto devices = cuda::openDevices({0}, [&] {
    ++asked;
    return std::exchange(parked, nullptr) != nullptr;
  });
  parked = makeCudaRenderer(one, devices);
  rendered(*parked, obliqueScene(*one, 16, 16), 1);
  substitute::limitMemory(allocated() + 3 * kMiB);
  const auto renderer = makeCudaRenderer(other, devices);
  const Scene scene = obliqueScene(*other, 16, 16);
  expectSamePicture(rendered(*renderer, scene), pictureOfTheCpu(other, scene));
  EXPECT_EQ(asked, 1);
  EXPECT_FALSE(parked);
}

TEST_F(CudaLauncher, IsBusyOnlyWhileOthersHoldMemoryThatWouldBeEnough) {
  const auto one = volumeOf(gridOf(kDims), channel(0)), other = volumeOf(gridOf(kDims), channel(1)),
             large = volumeOf(gridOf(kDims), channel(0), channel(1), channel(2), channel(3));
  const Scene scene = obliqueScene(*one, 16, 16);
  int asked = 0;
  const auto devices = cuda::openDevices({0}, [&] { return ++asked, false; });
  auto first = makeCudaRenderer(one, devices);
  const auto second = makeCudaRenderer(other, devices), third = makeCudaRenderer(large, devices);
  rendered(*first, scene, 1);
  const std::size_t limit = allocated() + 2 * kMiB;
  ASSERT_LT(limit, 15 * kMiB);  // the channels of the large volume
  substitute::limitMemory(limit);
  const Error busy = refusal(*second, scene);
  EXPECT_EQ(busy.code(), ErrorCode::busy);
  EXPECT_EQ(busy.what(), "memory of a CUDA device: expected at most " + mebibytes(limit) +
                             ", of which 4 MiB are in use, found 4 MiB");
  EXPECT_EQ(asked, 1);
  Scene ofAll = obliqueScene(*large, 16, 16);
  ofAll.channels[3].visible = true;
  EXPECT_EQ(refusal(*third, ofAll).code(), ErrorCode::tooLarge);
  ASSERT_TRUE(first->renderSample(kNever));
  expectSamePicture(first->image(), pictureOfTheCpu(one, scene));
  first.reset();
  expectSamePicture(rendered(*second, scene), pictureOfTheCpu(other, scene));
}

/// Whether a call that another thread makes meanwhile ends at once. If it waits for the caller, it fails
/// after a while.
template <class F>
bool endsMeanwhile(std::future<void>& call, F&& f) {
  call = std::async(std::launch::async, std::forward<F>(f));
  return call.wait_for(std::chrono::seconds(20)) == std::future_status::ready;
}

TEST_F(CudaLauncher, DoesNotWaitForTheUploadOfAnotherSession) {
  const auto memory = std::make_shared<cuda::DeviceMemory>([] { return false; });
  cuda::Uploader uploader;
  const auto voxels = volumeOf(gridOf(kDims), channel(0), channel(1));
  cuda::DeviceVolume volume(voxels, *memory, uploader);
  const int channels[] = {0, 1};
  const auto never = [] { return false; };
  ASSERT_TRUE(volume.upload({channels, 1}, never));
  std::future<void> asking, stopped;
  bool answered = false, ended = false, first = false, second = true;
  ASSERT_TRUE(volume.upload(channels, [&] {
    answered = endsMeanwhile(asking, [&] {
      first = volume.has(0);
      second = volume.has(1);
    });
    ended = endsMeanwhile(stopped, [&] { EXPECT_FALSE(volume.upload(channels, [] { return true; })); });
    return false;
  }));
  asking.wait();
  stopped.wait();
  EXPECT_TRUE(answered);
  EXPECT_TRUE(first && !second);
  EXPECT_TRUE(ended) << "it was stopped, and needs not wait for another thread's upload";
}

TEST_F(CudaLauncher, KeepsChannelsThatSomebodyHolds) {
  const auto memory = std::make_shared<cuda::DeviceMemory>([] { return false; });
  cuda::Uploader uploader;
  const auto voxels = volumeOf(gridOf(kDims), channel(0), channel(1));
  cuda::DeviceVolume volume(voxels, *memory, uploader);
  const int channels[] = {0, 1};
  auto planes = volume.upload(channels, [] { return false; });
  ASSERT_TRUE(planes);
  EXPECT_NE(planes->at(0), planes->at(1));
  EXPECT_FALSE(volume.dropUnused());
  EXPECT_EQ(volume.heldBytes(), 2u * 160 * 160 * 160);
  planes->pop_back();
  EXPECT_EQ(volume.heldBytes(), 160u * 160 * 160);
  EXPECT_TRUE(volume.dropUnused());
  EXPECT_FALSE(volume.dropUnused());
  EXPECT_TRUE(volume.has(0));
  EXPECT_FALSE(volume.has(1));
  planes.reset();
  EXPECT_FALSE(volume.isEmpty());
  EXPECT_TRUE(volume.dropUnused());
  EXPECT_TRUE(volume.isEmpty());
}

TEST(FairMutex, IsGivenToWhoeverAskedFirst) {
  cuda::FairMutex mutex;
  std::string order;
  mutex.lock();
  std::thread other([&] {
    const std::lock_guard turn(mutex);
    order += 'b';
  });
  while (mutex.asking() < 2) std::this_thread::yield();
  order += 'a';
  mutex.unlock();
  mutex.lock();
  order += 'c';
  mutex.unlock();
  other.join();
  EXPECT_EQ(order, "abc");
}

}  // namespace
}  // namespace scolopax
