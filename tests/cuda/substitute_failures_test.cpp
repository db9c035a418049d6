// SPDX-License-Identifier: Apache-2.0
// The substitute runtime: failures on request, and the state after them.
#include <functional>

#include "tests/cuda/substitute_objects.h"

namespace substitute::test {
namespace {

using SubstituteFailures = SubstituteTest;

/// Calls every function, as a launcher could. Stops at the first error and returns it.
cudaError_t callEverything() {
  cudaError_t first = cudaSuccess;
  const auto ok = [&](cudaError_t result) { return (first = result) == cudaSuccess; };
  int number = 0;
  cudaDeviceProp properties;
  std::size_t freeBytes = 0, totalBytes = 0;
  if (!ok(cudaGetDeviceCount(&number)) || !ok(cudaGetDevice(&number)) || !ok(cudaSetDevice(number)) ||
      !ok(cudaGetDeviceProperties(&properties, 0)) ||
      !ok(cudaDeviceGetAttribute(&number, cudaDevAttrMultiProcessorCount, 0)) ||
      !ok(cudaMemGetInfo(&freeBytes, &totalBytes)))
    return first;
  DeviceInts memory = deviceInts(1);
  PinnedInts pinned = memory ? pinnedInts({4}, cudaHostAllocMapped) : nullptr;
  Stream stream = pinned ? newStream() : nullptr;
  Event start = stream ? newEvent(cudaEventDefault) : nullptr,
        end = start ? newEvent(cudaEventDefault) : nullptr;
  if (!end) return cudaPeekAtLastError();
  float milliseconds = 0;
  int host = 0;
  void* mapped = nullptr;
  if (!ok(cudaHostGetDevicePointer(&mapped, pinned.get(), 0)) || !ok(cudaMemset(memory.get(), 0, 4)) ||
      !ok(cudaEventRecord(start.get(), stream.get())) ||
      !ok(cudaMemsetAsync(memory.get(), 0, 4, stream.get())) || !ok(upload(memory, pinned, 1, stream)) ||
      !ok(launchBlocks(stream.get(), dim3(1), dim3(1), [to = memory.get()](uint3) { ++*to; })) ||
      !ok(download(pinned, memory, 1, stream)) || !ok(cudaEventRecord(end.get(), stream.get())) ||
      !ok(cudaStreamWaitEvent(stream.get(), end.get())) || !ok(cudaEventSynchronize(end.get())) ||
      !ok(cudaEventElapsedTime(&milliseconds, start.get(), end.get())) || !ok(cudaEventQuery(end.get())) ||
      !ok(cudaStreamSynchronize(stream.get())) || !ok(cudaStreamQuery(stream.get())) ||
      !ok(cudaDeviceSynchronize()) || !ok(cudaMemcpy(&host, memory.get(), 4, cudaMemcpyDeviceToHost)))
    return first;
  EXPECT_EQ(host, 5);
  EXPECT_EQ(pinned[0], 5);
  const cudaError_t freed[] = {cudaEventDestroy(end.release()), cudaEventDestroy(start.release()),
                               cudaStreamDestroy(stream.release()), cudaFreeHost(pinned.release()),
                               cudaFree(memory.release())};
  for (const cudaError_t result : freed)
    if (result != cudaSuccess) return result;
  return cudaSuccess;
}

TEST_F(SubstituteFailures, AreThoseOfEveryCallInTurn) {
  ASSERT_EQ(callEverything(), cudaSuccess);
  const std::size_t calls = callCount();
  EXPECT_EQ(calls, 32u);
  for (std::size_t n = 1; n <= calls; ++n) {
    SCOPED_TRACE(n);
    failCall(n, cudaErrorInvalidConfiguration);
    EXPECT_EQ(callEverything(), cudaErrorInvalidConfiguration);
    EXPECT_EQ(cudaGetLastError(), cudaErrorInvalidConfiguration);
    EXPECT_EQ(cudaGetLastError(), cudaSuccess);
    EXPECT_EQ(leaks(), Leaks());
    EXPECT_TRUE(substitute::reset());
  }
}

TEST_F(SubstituteFailures, OfACallPreventItsEffectButNotThatOfFreeing) {
  const Stream stream = newStream();
  const DeviceInts memory = deviceInts(1);
  const PinnedInts from = pinnedInts({3});
  failCall(2, cudaErrorInvalidValue);
  EXPECT_EQ(upload(memory, from, 1, stream), cudaSuccess);
  EXPECT_EQ(cudaStreamSynchronize(stream.get()), cudaErrorInvalidValue);
  EXPECT_EQ(contents(memory, 1), std::vector<int>{kPoisonInt});
  EXPECT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
  EXPECT_EQ(contents(memory, 1), std::vector<int>{3});
  int count = 9;
  failCall(1, cudaErrorInsufficientDriver);
  EXPECT_EQ(cudaGetDeviceCount(&count), cudaErrorInsufficientDriver);
  EXPECT_EQ(count, 9);
  DeviceInts more = deviceInts(1);
  failCall(1, cudaErrorInvalidValue);
  EXPECT_EQ(cudaFree(more.release()), cudaErrorInvalidValue);
  EXPECT_EQ(leaks().deviceAllocations, 1u);
  failCall(1, cudaErrorInvalidValue);
  failCall(0, cudaSuccess);
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess) << "taken back";
}

TEST_F(SubstituteFailures, ShowWhatIsStillAlive) {
  DeviceInts memory = deviceInts(1);
  PinnedInts pinned = pinnedInts({1, 2});
  Stream stream = newStream();
  Event event = newEvent(), another = newEvent();
  EXPECT_EQ(leaks(), (Leaks{1, 1, 1, 2}));
  EXPECT_EQ(allocations().size(), 1u);
  memory.reset();
  EXPECT_FALSE(substitute::reset());
  pinned.reset();
  EXPECT_FALSE(substitute::reset());
  stream.reset();
  EXPECT_FALSE(substitute::reset());
  event.reset();
  EXPECT_FALSE(substitute::reset());
  another.reset();
  EXPECT_GT(callCount(), 0u);
  EXPECT_TRUE(substitute::reset());
  EXPECT_EQ(callCount(), 0u);
}

TEST_F(SubstituteFailures, OfUnknownHandlesAndMemoryAreErrors) {
  Stream stream = newStream();
  Event event = newEvent();
  const cudaStream_t oldStream = stream.get();
  const cudaEvent_t oldEvent = event.get();
  stream.reset();
  event.reset();
  EXPECT_EQ(cudaStreamSynchronize(oldStream), cudaErrorInvalidResourceHandle);
  EXPECT_EQ(cudaStreamDestroy(oldStream), cudaErrorInvalidResourceHandle);
  EXPECT_EQ(cudaStreamDestroy(nullptr), cudaErrorInvalidResourceHandle);
  EXPECT_EQ(cudaEventQuery(oldEvent), cudaErrorInvalidResourceHandle);
  EXPECT_EQ(cudaEventRecord(oldEvent), cudaErrorInvalidResourceHandle);
  int local = 0;
  EXPECT_EQ(cudaFree(&local), cudaErrorInvalidValue);
  EXPECT_EQ(cudaFreeHost(&local), cudaErrorInvalidValue);
  EXPECT_EQ(cudaPeekAtLastError(), cudaErrorInvalidValue);
  EXPECT_EQ(cudaGetLastError(), cudaErrorInvalidValue);
}

TEST_F(SubstituteFailures, OfADeviceStayWhileOtherDevicesWork) {
  setDeviceCount(cudaSuccess, 2);
  cudaSetDevice(1);
  DeviceInts memory = deviceInts(1);
  PinnedInts pinned = pinnedInts({1});
  Stream stream = newStream();
  Event event = newEvent();
  download(pinned, memory, 1, stream);
  cudaEventRecord(event.get(), stream.get());
  cudaSetDevice(0);
  const Stream healthy = newStream();
  cudaStreamWaitEvent(healthy.get(), event.get());
  bool ran = false;
  launchHost(healthy.get(), [&] { ran = true; });

  loseDevice(1);
  EXPECT_EQ(cudaStreamSynchronize(healthy.get()), cudaSuccess) << "nothing waits for a lost device";
  EXPECT_TRUE(ran);
  EXPECT_EQ(callEverything(), cudaSuccess);
  int value = 0;
  const std::vector<std::function<cudaError_t()>> calls{
      [&] { return cudaSetDevice(1); },
      [&] { return cudaDeviceGetAttribute(&value, cudaDevAttrMultiProcessorCount, 1); },
      [&] { return cudaStreamSynchronize(stream.get()); },
      [&] { return cudaStreamQuery(stream.get()); },
      [&] { return cudaStreamWaitEvent(healthy.get(), event.get()); },
      [&] { return cudaEventQuery(event.get()); },
      [&] { return cudaEventSynchronize(event.get()); },
      [&] { return download(pinned, memory, 1, stream); },
      [&] { return launchBlocks(stream.get(), dim3(1), dim3(1), [](uint3) {}); },
      [&] { return cudaEventDestroy(event.release()); },
      [&] { return cudaStreamDestroy(stream.release()); },
      [&] {
        EXPECT_EQ(pinned[0], kPoisonInt);
        return cudaFreeHost(pinned.release());
      },
      [&] { return cudaFree(memory.release()); }};
  for (std::size_t i = 0; i < calls.size(); ++i) {
    EXPECT_EQ(calls[i](), cudaErrorIllegalAddress) << i;
    EXPECT_EQ(cudaGetLastError(), cudaErrorIllegalAddress);
    EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "the current device is another";
  }
  EXPECT_EQ(leaks(), (Leaks{0, 0, 1, 0})) << "only the healthy stream";
}

TEST_F(SubstituteFailures, OfTheCurrentDeviceAreItsLastErrorForGood) {
  loseDevice(0);
  EXPECT_FALSE(deviceInts(1));
  EXPECT_FALSE(pinnedInts({1}));
  EXPECT_FALSE(newStream());
  EXPECT_FALSE(newEvent());
  EXPECT_EQ(cudaDeviceSynchronize(), cudaErrorIllegalAddress);
  EXPECT_EQ(launchBlocks(nullptr, dim3(1), dim3(1), [](uint3) {}), cudaErrorIllegalAddress);
  EXPECT_EQ(cudaGetLastError(), cudaErrorIllegalAddress);
  EXPECT_EQ(cudaGetLastError(), cudaErrorIllegalAddress);
  EXPECT_EQ(cudaPeekAtLastError(), cudaErrorIllegalAddress);
  EXPECT_TRUE(substitute::reset());
  EXPECT_EQ(cudaGetLastError(), cudaSuccess);
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
}

TEST_F(SubstituteFailures, OfKernelsSurfaceOnceAtTheNextWaitForTheirDevice) {
  setDeviceCount(cudaSuccess, 2);
  cudaSetDevice(1);
  const Stream stream = newStream();
  const Event event = newEvent(), recorded = newEvent();
  int host = 0;
  const DeviceInts memory = deviceInts(1);
  const std::vector<std::function<cudaError_t()>> waits{[&] { return cudaStreamSynchronize(stream.get()); },
                                                        [&] { return cudaStreamQuery(stream.get()); },
                                                        [&] { return cudaEventSynchronize(recorded.get()); },
                                                        [&] { return cudaEventQuery(recorded.get()); },
                                                        [] { return cudaDeviceSynchronize(); },
                                                        [&] {
                                                          cudaStreamQuery(stream.get());
                                                          reportFault("again");
                                                          return cudaMemcpy(&host, memory.get(), 4,
                                                                            cudaMemcpyDeviceToHost);
                                                        }};
  for (std::size_t i = 0; i < waits.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(launchBlocks(stream.get(), dim3(3), dim3(1), [](uint3) { reportFault("a kernel"); }),
              cudaSuccess);
    cudaEventRecord(recorded.get(), stream.get());
    cudaSetDevice(0);
    EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess) << "another device";
    cudaSetDevice(1);
    EXPECT_EQ(waits[i](), cudaErrorIllegalAddress);
    EXPECT_EQ(lastFault(), i + 1 < waits.size() ? "a kernel" : "again");
    EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
    EXPECT_EQ(cudaEventSynchronize(event.get()), cudaSuccess);
  }
}

}  // namespace
}  // namespace substitute::test
