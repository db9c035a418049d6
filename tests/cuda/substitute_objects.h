// SPDX-License-Identifier: Apache-2.0
// Owners of the objects of the substitute runtime, and helpers for its tests.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/cuda/substitute_runtime.h"

namespace substitute::test {

template <auto kFree>
struct Frees {
  void operator()(auto* owned) const { kFree(owned); }
};
using DeviceInts = std::unique_ptr<int[], Frees<cudaFree>>;
using PinnedInts = std::unique_ptr<int[], Frees<cudaFreeHost>>;
using Stream = std::unique_ptr<CUstream_st, Frees<cudaStreamDestroy>>;
using Event = std::unique_ptr<CUevent_st, Frees<cudaEventDestroy>>;

inline constexpr int kPoisonInt = int(0xcdcdcdcd);

// The following functions return null after a failure.
inline DeviceInts deviceInts(std::size_t count) {
  void* memory = nullptr;
  cudaMalloc(&memory, count * sizeof(int));
  return DeviceInts(static_cast<int*>(memory));
}
inline PinnedInts pinnedInts(const std::vector<int>& values, unsigned flags = cudaHostAllocDefault) {
  void* memory = nullptr;
  if (cudaHostAlloc(&memory, values.size() * sizeof(int), flags) != cudaSuccess) return nullptr;
  std::copy(values.begin(), values.end(), static_cast<int*>(memory));
  return PinnedInts(static_cast<int*>(memory));
}
inline Stream newStream(unsigned flags = cudaStreamNonBlocking) {
  cudaStream_t stream = nullptr;
  cudaStreamCreateWithFlags(&stream, flags);
  return Stream(stream);
}
inline Event newEvent(unsigned flags = cudaEventDisableTiming) {
  cudaEvent_t event = nullptr;
  cudaEventCreateWithFlags(&event, flags);
  return Event(event);
}

inline cudaError_t upload(const DeviceInts& to, const PinnedInts& from, std::size_t count,
                          const Stream& stream) {
  return cudaMemcpyAsync(to.get(), from.get(), count * sizeof(int), cudaMemcpyHostToDevice, stream.get());
}
inline cudaError_t download(const PinnedInts& to, const DeviceInts& from, std::size_t count,
                            const Stream& stream) {
  return cudaMemcpyAsync(to.get(), from.get(), count * sizeof(int), cudaMemcpyDeviceToHost, stream.get());
}
/// The contents of device memory, by a blocking copy.
inline std::vector<int> contents(const DeviceInts& memory, std::size_t count) {
  std::vector<int> found(count);
  EXPECT_EQ(cudaMemcpy(found.data(), memory.get(), count * sizeof(int), cudaMemcpyDeviceToHost), cudaSuccess);
  return found;
}

/// Restores the runtime's initial state, and checks that nothing is left alive.
class SubstituteTest : public testing::Test {
 protected:
  ~SubstituteTest() override { EXPECT_TRUE(reset()) << "something is still alive"; }
};

}  // namespace substitute::test
