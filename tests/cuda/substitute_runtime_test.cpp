// SPDX-License-Identifier: Apache-2.0
// The substitute runtime's streams. A launcher that would fail on a device must also fail here.
#include <atomic>
#include <thread>

#include "tests/cuda/substitute_objects.h"

namespace substitute::test {
namespace {

using Ints = std::vector<int>;
using SubstituteStreams = SubstituteTest;

TEST_F(SubstituteStreams, RunCopiesOnlyWhenSomethingWaitsForThem) {
  const Stream stream = newStream();
  const DeviceInts memory = deviceInts(2);
  const PinnedInts from = pinnedInts({1, 2}), to = pinnedInts({7, 7});
  ASSERT_EQ(cudaMemset(memory.get(), 0, 8), cudaSuccess);
  ASSERT_EQ(upload(memory, from, 2, stream), cudaSuccess);
  ASSERT_EQ(download(to, memory, 2, stream), cudaSuccess);
  EXPECT_EQ(to[1], kPoisonInt) << "read before the stream was synchronised";
  EXPECT_EQ(contents(memory, 2), Ints(2, kPoisonInt)) << "blocking copies do not wait for other streams";
  EXPECT_EQ(bytesToDevice(), 0u);
  EXPECT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
  EXPECT_EQ(to[1], 2);
  EXPECT_EQ(contents(memory, 2), Ints({1, 2}));
  EXPECT_EQ(bytesToDevice(), 8u);
}

TEST_F(SubstituteStreams, ReadTheHostsMemoryWhenTheyCopyIt) {
  const Stream stream = newStream();
  const DeviceInts memory = deviceInts(1);
  const PinnedInts from = pinnedInts({1});
  upload(memory, from, 1, stream);
  from[0] = 2;  // too early
  cudaStreamSynchronize(stream.get());
  EXPECT_EQ(contents(memory, 1), Ints{2});
}

TEST_F(SubstituteStreams, PoisonNothingThatEarlierWorkMayStillRead) {
  const Stream stream = newStream();
  const DeviceInts memory = deviceInts(1), other = deviceInts(1);
  const PinnedInts host = pinnedInts({1}), next = pinnedInts({5});
  int seen = 0;
  upload(memory, host, 1, stream);
  download(host, other, 1, stream);
  launchHost(stream.get(), [&] { seen = memory[0]; });
  upload(memory, next, 1, stream);
  cudaStreamSynchronize(stream.get());
  EXPECT_EQ(seen, 1);
  EXPECT_EQ(contents(memory, 1), Ints{5});
  EXPECT_EQ(host[0], kPoisonInt) << "from new memory";
}

TEST_F(SubstituteStreams, AreInOrderOnlyWhereEventsSaySo) {
  const Stream first = newStream(), second = newStream();
  const DeviceInts memory = deviceInts(1);
  const PinnedInts from = pinnedInts({1}), to = pinnedInts({0});
  const Event uploaded = newEvent(), later = newEvent();
  EXPECT_EQ(cudaStreamWaitEvent(second.get(), uploaded.get()), cudaSuccess)
      << "never recorded: nothing to wait for";
  upload(memory, from, 1, first);
  EXPECT_EQ(cudaEventRecord(uploaded.get(), first.get()), cudaSuccess);
  download(to, memory, 1, second);
  cudaStreamSynchronize(second.get());
  EXPECT_EQ(to[0], kPoisonInt);

  bool laterWorkRan = false;
  EXPECT_EQ(cudaStreamWaitEvent(second.get(), uploaded.get()), cudaSuccess);
  download(to, memory, 1, second);
  launchHost(first.get(), [&] { laterWorkRan = true; });
  cudaEventRecord(uploaded.get(), first.get());  // the wait is still for the first record
  cudaStreamSynchronize(second.get());
  EXPECT_EQ(to[0], 1);
  EXPECT_FALSE(laterWorkRan);
  EXPECT_EQ(cudaEventSynchronize(uploaded.get()), cudaSuccess);
  EXPECT_TRUE(laterWorkRan);
}

TEST_F(SubstituteStreams, RunOneOperationEachTimeTheyAreAsked) {
  const Stream stream = newStream(), other = newStream();
  const Event event = newEvent(cudaEventDisableTiming | cudaEventBlockingSync);
  int ran = 0;
  for (int i = 0; i < 3; ++i) launchHost(stream.get(), [&] { ++ran; });
  for (int i = 1; i < 3; ++i) {
    EXPECT_EQ(cudaStreamQuery(stream.get()), cudaErrorNotReady);
    EXPECT_EQ(ran, i);
  }
  EXPECT_EQ(cudaStreamQuery(stream.get()), cudaSuccess);
  EXPECT_EQ(cudaGetLastError(), cudaErrorNotReady);

  EXPECT_EQ(cudaEventQuery(event.get()), cudaSuccess) << "never recorded";
  for (int i = 0; i < 2; ++i) launchHost(stream.get(), [&] { ++ran; });
  cudaEventRecord(event.get(), stream.get());
  cudaStreamWaitEvent(other.get(), event.get());
  EXPECT_EQ(cudaEventQuery(event.get()), cudaErrorNotReady);
  EXPECT_EQ(cudaStreamQuery(other.get()), cudaErrorNotReady) << "runs what the other stream waits for";
  EXPECT_EQ(ran, 5);
  EXPECT_EQ(cudaEventQuery(event.get()), cudaSuccess);
  EXPECT_EQ(cudaStreamQuery(other.get()), cudaSuccess);
}

TEST_F(SubstituteStreams, AreAllFinishedWhenTheDeviceIsSynchronised) {
  const Stream first = newStream(), second = newStream();
  const Event event = newEvent();
  std::string order;
  launchHost(second.get(), [&] { order += 'a'; });
  cudaEventRecord(event.get(), second.get());
  cudaStreamWaitEvent(first.get(), event.get());
  launchHost(first.get(), [&] { order += 'b'; });
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
  EXPECT_EQ(order, "ab");
}

TEST_F(SubstituteStreams, DoWorkOfTheDefaultStreamAtOnceAndAfterThatOfBlockingStreams) {
  const Stream nonBlocking = newStream(), blocking = newStream(cudaStreamDefault);
  const Event event = newEvent();
  std::string order;
  launchHost(nonBlocking.get(), [&] { order += 'n'; });
  cudaEventRecord(event.get(), nonBlocking.get());
  launchHost(blocking.get(), [&] { order += 'b'; });
  launchHost(nullptr, [&] { order += 'd'; });
  EXPECT_EQ(order, "bd");
  EXPECT_EQ(cudaStreamWaitEvent(nullptr, event.get()), cudaSuccess);
  EXPECT_EQ(order, "bdn");
}

TEST_F(SubstituteStreams, CopyAsynchronouslyOnlyPinnedMemory) {
  const Stream stream = newStream();
  const DeviceInts memory = deviceInts(2);
  const PinnedInts pinned = pinnedInts({1, 2});
  int pageable[2] = {3, 4};
  for (const cudaStream_t each : {stream.get(), cudaStream_t(nullptr)}) {
    EXPECT_EQ(cudaMemcpyAsync(memory.get(), pageable, 8, cudaMemcpyHostToDevice, each),
              cudaErrorInvalidValue);
    EXPECT_EQ(cudaMemcpyAsync(pageable, memory.get(), 8, cudaMemcpyDeviceToHost, each),
              cudaErrorInvalidValue);
    EXPECT_EQ(cudaMemcpyAsync(memory.get(), pinned.get() + 1, 8, cudaMemcpyHostToDevice, each),
              cudaErrorInvalidValue);
    EXPECT_EQ(cudaMemcpyAsync(pinned.get(), memory.get() + 1, 8, cudaMemcpyDeviceToHost, each),
              cudaErrorInvalidValue);
  }
  EXPECT_EQ(pageable[0], 3);
  EXPECT_EQ(cudaMemcpy(memory.get(), pageable, 8, cudaMemcpyHostToDevice), cudaSuccess);
  EXPECT_EQ(contents(memory, 2), Ints({3, 4}));
  EXPECT_EQ(bytesToDevice(), 8u);
  EXPECT_EQ(cudaGetLastError(), cudaErrorInvalidValue);
}

TEST_F(SubstituteStreams, FinishTheirWorkAfterTheyAreDestroyed) {
  const DeviceInts memory = deviceInts(1);
  const PinnedInts from = pinnedInts({1});
  Stream stream = newStream();
  upload(memory, from, 1, stream);
  stream.reset();
  EXPECT_EQ(leaks().streams, 0u);
  EXPECT_EQ(contents(memory, 1), Ints{kPoisonInt});
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
  EXPECT_EQ(contents(memory, 1), Ints{1});
}

TEST_F(SubstituteStreams, FinishTheirWorkBeforeItsMemoryIsFreed) {
  const Stream stream = newStream(), other = newStream();
  DeviceInts memory = deviceInts(1), unused = deviceInts(1);
  PinnedInts from = pinnedInts({1}), to = pinnedInts({2});
  upload(memory, from, 1, stream);
  to.reset();
  EXPECT_EQ(freesThatWaited(), 0u) << "not used by what is queued";
  from.reset();
  EXPECT_EQ(freesThatWaited(), 1u);
  EXPECT_EQ(contents(memory, 1), Ints{1});
  int seen = 0;
  launchHost(other.get(), [&] { seen = memory[0]; });
  unused.reset();
  EXPECT_EQ(freesThatWaited(), 2u) << "kernels may use any device memory";
  EXPECT_EQ(seen, 1);
  memory.reset();
  EXPECT_EQ(freesThatWaited(), 2u);
}

TEST_F(SubstituteStreams, TellTheTimeBetweenEvents) {
  const Stream stream = newStream();
  const Event start = newEvent(cudaEventDefault), end = newEvent(cudaEventDefault), untimed = newEvent();
  float milliseconds = -1;
  EXPECT_EQ(cudaEventElapsedTime(&milliseconds, start.get(), end.get()), cudaErrorInvalidResourceHandle);
  cudaEventRecord(start.get(), stream.get());
  launchHost(stream.get(), [] { std::this_thread::sleep_for(std::chrono::milliseconds(2)); });
  for (const Event* event : {&end, &untimed}) cudaEventRecord(event->get(), stream.get());
  EXPECT_EQ(cudaEventElapsedTime(&milliseconds, start.get(), end.get()), cudaErrorNotReady);
  cudaStreamSynchronize(stream.get());
  EXPECT_EQ(cudaEventElapsedTime(&milliseconds, start.get(), untimed.get()), cudaErrorInvalidResourceHandle);
  EXPECT_EQ(milliseconds, -1);
  EXPECT_EQ(cudaEventElapsedTime(&milliseconds, start.get(), end.get()), cudaSuccess);
  EXPECT_GE(milliseconds, 2);
}

TEST_F(SubstituteStreams, ServeSeveralThreadsWithStreamsOfTheirOwn) {
  std::vector<std::thread> threads;
  std::atomic<int> wrong = 0;
  for (int n = 0; n < 4; ++n)
    threads.emplace_back([n, &wrong] {
      const Stream stream = newStream();
      const Event event = newEvent();
      const DeviceInts memory = deviceInts(1);
      const PinnedInts from = pinnedInts({0}), to = pinnedInts({0});
      for (int i = 0; i < 50; ++i) {
        from[0] = 100 * n + i;
        upload(memory, from, 1, stream);
        launchBlocks(stream.get(), dim3(1), dim3(1), [&](uint3) { ++memory[0]; });
        download(to, memory, 1, stream);
        cudaEventRecord(event.get(), stream.get());
        while (cudaEventQuery(event.get()) == cudaErrorNotReady) std::this_thread::yield();
        wrong += to[0] != 100 * n + i + 1;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace substitute::test
