// SPDX-License-Identifier: Apache-2.0
// The substitute runtime: kernels, and several devices at the same time.
#include <cuda_runtime.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <set>
#include <thread>

#include "tests/cuda/substitute_objects.h"

namespace substitute::test {
namespace {

using Ints = std::vector<int>;
using SubstituteDevices = SubstituteTest;
using SubstituteKernels = SubstituteTest;

struct Sum {
  int* to;
  int add;
};
void addToAll(Sum sum, const int* factor) {
  sum.to[blockIdx.x * blockDim.x + threadIdx.x] += sum.add * *factor;
}

TEST_F(SubstituteKernels, AreGivenCopiesOfTheirArguments) {
  const Stream stream = newStream();
  const DeviceInts memory = deviceInts(8);
  cudaMemset(memory.get(), 0, 32);
  cudaMemset(memory.get(), 1, 1);
  {
    Sum sum{memory.get() + 2, 5};
    const int* factor = memory.get();
    void* arguments[] = {&sum, &factor};
    EXPECT_EQ(cudaLaunchKernel(addToAll, dim3(3), dim3(2), arguments, 0, stream.get()), cudaSuccess);
    sum = {nullptr, 0};
    factor = nullptr;
  }
  EXPECT_EQ(contents(memory, 8), Ints({1, 0, 0, 0, 0, 0, 0, 0}));
  cudaStreamSynchronize(stream.get());
  EXPECT_EQ(contents(memory, 8), Ints({1, 0, 5, 5, 5, 5, 5, 5}));
}

TEST_F(SubstituteKernels, RunTheirBlocksInAnotherOrderEachTime) {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const auto orderOfALaunch = [] {
    Ints order;
    launchBlocks(nullptr, dim3(4, 5, 3), dim3(1),
                 [&](uint3 block) { order.push_back(int(block.x + 4 * (block.y + 5 * block.z))); });
    return order;
  };
  const Ints first = orderOfALaunch(), second = orderOfALaunch();
  EXPECT_EQ(std::set<int>(first.begin(), first.end()).size(), 60u);
  EXPECT_EQ(first.size(), 60u);
  EXPECT_FALSE(std::is_sorted(first.begin(), first.end()));
  EXPECT_NE(first, second);
  ASSERT_TRUE(reset());
  EXPECT_EQ(orderOfALaunch(), first) << "but in the same every time the program runs";
}

TEST_F(SubstituteKernels, AreRefusedInSizesThatNoDeviceCanRun) {
  const auto result = [](dim3 grid, dim3 block) { return launchBlocks(nullptr, grid, block, [](uint3) {}); };
  EXPECT_EQ(result(dim3(1), dim3(1024)), cudaSuccess);
  for (const dim3 block : {dim3(0), dim3(32, 33), dim3(1, 1, 65), dim3(1u << 31, 2)})
    EXPECT_EQ(result(dim3(1), block), cudaErrorInvalidConfiguration);
  for (const dim3 grid : {dim3(0), dim3(1, 65536), dim3(1, 1, 65536)})
    EXPECT_EQ(result(grid, dim3(1)), cudaErrorInvalidConfiguration);
  EXPECT_EQ(launchKernel(nullptr, dim3(1), dim3(65), 64, [](auto) {}), cudaErrorInvalidValue);
  EXPECT_EQ(launchKernel(nullptr, dim3(1), dim3(64), 64, nullptr), cudaErrorInvalidDeviceFunction);
}

TEST_F(SubstituteDevices, TellWhatTheyAre) {
  setDeviceCount(cudaSuccess, 2);
  limitMemory(1, 1000);
  cudaDeviceProp properties;
  ASSERT_EQ(cudaGetDeviceProperties(&properties, 1), cudaSuccess);
  EXPECT_STREQ(properties.name, "Substitute device 1");
  EXPECT_EQ(properties.totalGlobalMem, 1000u);
  int major = 0, processors = 0;
  EXPECT_EQ(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, 1), cudaSuccess);
  EXPECT_EQ(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, 1), cudaSuccess);
  EXPECT_EQ(major, properties.major);
  EXPECT_EQ(processors, properties.multiProcessorCount);
  for (const int none : {-1, 2}) {
    EXPECT_EQ(cudaGetDeviceProperties(&properties, none), cudaErrorInvalidDevice);
    EXPECT_EQ(cudaSetDevice(none), cudaErrorInvalidDevice);
  }
}

TEST_F(SubstituteDevices, HaveMemoryOfTheirOwn) {
  setDeviceCount(cudaSuccess, 2);
  limitMemory(100);
  limitMemory(1, 10);
  const DeviceInts zero = deviceInts(25);
  EXPECT_FALSE(deviceInts(1));
  cudaSetDevice(1);
  const DeviceInts one = deviceInts(2);
  EXPECT_FALSE(deviceInts(1));
  EXPECT_EQ(cudaGetLastError(), cudaErrorMemoryAllocation);
  std::size_t freeBytes = 0, totalBytes = 0;
  EXPECT_EQ(cudaMemGetInfo(&freeBytes, &totalBytes), cudaSuccess);
  EXPECT_EQ(freeBytes, 2u);
  EXPECT_EQ(totalBytes, 10u);

  const Stream stream = newStream();
  const PinnedInts pinned = pinnedInts({1});
  EXPECT_EQ(upload(zero, pinned, 1, stream), cudaErrorInvalidValue);
  EXPECT_EQ(download(pinned, zero, 1, stream), cudaErrorInvalidValue);
  EXPECT_EQ(cudaMemsetAsync(zero.get(), 0, 4, stream.get()), cudaErrorInvalidValue);
  EXPECT_EQ(cudaMemset(zero.get(), 0, 4), cudaErrorInvalidValue);
  EXPECT_EQ(cudaMemcpy(zero.get(), pinned.get(), 4, cudaMemcpyHostToDevice), cudaErrorInvalidValue);
  EXPECT_EQ(upload(one, pinned, 1, stream), cudaSuccess);
  std::vector<const void*> seen;
  launchKernel(stream.get(), dim3(1), dim3(1), 1, [&](std::span<const Allocation> memory) {
    for (const Allocation& each : memory) seen.push_back(each.begin);
  });
  cudaSetDevice(0);
  EXPECT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
  EXPECT_EQ(seen, std::vector<const void*>{one.get()});
}

TEST_F(SubstituteKernels, UseMemoryOfTheHostThatIsMappedToTheirDevice) {
  setDeviceCount(cudaSuccess, 2);
  PinnedInts mapped = pinnedInts({1, 2}, cudaHostAllocMapped);
  const PinnedInts other = pinnedInts({3});
  void* onDevice = nullptr;
  EXPECT_EQ(cudaHostGetDevicePointer(&onDevice, mapped.get(), 0), cudaSuccess);
  EXPECT_EQ(onDevice, mapped.get());
  EXPECT_EQ(cudaHostGetDevicePointer(&onDevice, mapped.get(), 1), cudaErrorInvalidValue);
  EXPECT_EQ(cudaHostGetDevicePointer(&onDevice, other.get(), 0), cudaErrorInvalidValue);
  EXPECT_TRUE(allocations().empty());
  ASSERT_EQ(mappedAllocations().size(), 1u);
  std::vector<const void*> seen;
  const auto look = [&](std::span<const Allocation> memory) {
    for (const Allocation& each : memory) seen.push_back(each.onHost ? each.begin : nullptr);
  };
  launchKernel(nullptr, dim3(1), dim3(1), 1, look);
  EXPECT_EQ(seen, std::vector<const void*>{mapped.get()});
  cudaSetDevice(1);
  EXPECT_EQ(cudaHostGetDevicePointer(&onDevice, mapped.get(), 0), cudaErrorInvalidValue);
  launchKernel(nullptr, dim3(1), dim3(1), 1, look);
  EXPECT_EQ(seen.size(), 1u);

  cudaSetDevice(0);
  const Stream stream = newStream();
  int read = 0;
  launchBlocks(stream.get(), dim3(1), dim3(1), [&, from = mapped.get()](uint3) { read = from[1]; });
  mapped.reset();
  EXPECT_EQ(freesThatWaited(), 1u);
  EXPECT_EQ(read, 2);
}

TEST_F(SubstituteKernels, CallATestBeforeABlock) {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  int blocks = 0, atCall = -1;
  const auto launch = [&] { launchBlocks(nullptr, dim3(3), dim3(1), [&](uint3) { ++blocks; }); };
  callBeforeBlock(5, [&] {
    EXPECT_EQ(atCall, -1);
    atCall = blocks;
  });
  launch();
  EXPECT_EQ(atCall, -1);
  launch();
  launch();
  EXPECT_EQ(atCall, 4);
}

TEST_F(SubstituteDevices, HaveStreamsAndEventsOfTheirOwn) {
  setDeviceCount(cudaSuccess, 2);
  const Stream stream = newStream();
  const Event event = newEvent(), unrelated = newEvent();
  bool ran = false;
  launchHost(stream.get(), [&] { ran = true; });
  cudaEventRecord(event.get(), stream.get());
  cudaSetDevice(1);
  const Stream other = newStream();
  EXPECT_EQ(launchBlocks(stream.get(), dim3(1), dim3(1), [](uint3) {}), cudaErrorInvalidResourceHandle);
  EXPECT_EQ(cudaEventRecord(unrelated.get(), other.get()), cudaErrorInvalidResourceHandle);
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
  EXPECT_FALSE(ran);
  EXPECT_EQ(cudaStreamWaitEvent(other.get(), event.get()), cudaSuccess)
      << "events order streams of all devices";
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
  EXPECT_TRUE(ran);
}

TEST_F(SubstituteDevices, AreChosenByEachThread) {
  setDeviceCount(cudaSuccess, 2);
  cudaSetDevice(1);
  int here = -1, there = -1;
  std::thread([&] {
    cudaGetDevice(&there);
    cudaSetDevice(7);
  }).join();
  EXPECT_EQ(cudaGetDevice(&here), cudaSuccess);
  EXPECT_EQ(here, 1);
  EXPECT_EQ(there, 0);
  EXPECT_EQ(cudaPeekAtLastError(), cudaSuccess) << "errors are each thread's own, too";
}

}  // namespace
}  // namespace substitute::test
