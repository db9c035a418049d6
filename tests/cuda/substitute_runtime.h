// SPDX-License-Identifier: Apache-2.0
// The functions of the substitute CUDA runtime that tests may call besides CUDA's own interface
// (substitute_state.h describes how it works). All may be called from several threads, but not from within a
// kernel.
#pragma once
#include <cuda_runtime_api.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace substitute {

/// Restores the state at the program's start: one device of 4 GiB, no failures, all counts 0; for every
/// thread, the current device is 0 and there is no last error. Returns false and changes nothing if leaks()
/// finds anything.
[[nodiscard]] bool reset();

// Devices and their memory.

/// Sets the result of cudaGetDeviceCount; a failure does not change its argument. Devices beyond the count
/// cannot be used, but objects that were created on them can still be freed.
void setDeviceCount(cudaError_t result, int count);

/// From now on, an allocation fails if it would exceed this number of bytes in all: on each device, or on an
/// existing one.
void limitMemory(std::size_t sizeBytes);
void limitMemory(int device, std::size_t sizeBytes);

struct Allocation {
  const std::byte* begin;
  std::size_t sizeBytes;
  int device;
  bool onHost = false;  ///< pinned memory that is mapped to the device
};
/// Allocations of device memory, or of mapped memory of the host, by address.
std::vector<Allocation> allocations();
std::vector<Allocation> mappedAllocations();

/// The value of all bytes of new memory, of the host memory that a queued copy will write, and of the device
/// memory that a queued copy will write next.
inline constexpr std::byte kPoison{0xcd};

/// Number of living objects of each kind, on all devices.
struct Leaks {
  std::size_t deviceAllocations = 0, pinnedAllocations = 0, streams = 0, events = 0;
  bool operator==(const Leaks&) const = default;
};
Leaks leaks();

/// Number of times that memory was freed while it was still in use: device memory while anything was queued
/// on its device, pinned memory while a copy of it was queued. cudaFree and cudaFreeHost then wait, as CUDA's
/// do. But NVIDIA does not promise that, and waiting stops every stream.
std::size_t freesThatWaited();

/// Bytes copied from the host to all devices so far. A queued copy counts when it runs. Arguments of kernels
/// do not count.
std::size_t bytesToDevice();

// Failures.

/// Number of calls of the runtime so far: of every function that can fail except cudaGetLastError and
/// cudaPeekAtLastError. launchBlocks, launchKernel and launchHost count as launches.
std::size_t callCount();

/// The n-th call from now (1: the next one) returns `error` and has no effect. But calls that free something
/// do free it, because nobody would try a second time. Replaces an earlier request; n = 0 cancels it.
void failCall(std::size_t n, cudaError_t error);

/// From now on, every call for this device, its streams, events or memory returns cudaErrorIllegalAddress; so
/// do cudaSetDevice and, while it is the current device, cudaGetLastError. Operations queued on it never run,
/// and nothing waits for them. Calls that free something also return the error, but do free it.
void loseDevice(int device);

/// The next call that waits for, or asks about, work of the device returns cudaErrorIllegalAddress. The
/// device is that of the kernel that is running, or else the current one. May be called from within a kernel.
void reportFault(const std::string& what);
/// The fault of the last kernel; empty if there was none.
std::string lastFault();

// Kernels. They run while the runtime is locked, so they must not call it.

/// Calls f() once, while a kernel runs: before its n-th block from now (1: the next one), in the thread that
/// runs the block. f must not call the runtime.
void callBeforeBlock(std::size_t n, std::function<void()> f);

/// Launches a kernel: when its turn comes, runBlock() is called for every block, in parallel and in a random
/// order. Returns the errors of cudaLaunchKernel: cudaErrorInvalidResourceHandle for a stream of a device
/// that is not the current one, cudaErrorInvalidConfiguration for sizes that no device can run.
cudaError_t launchBlocks(cudaStream_t stream, dim3 grid, dim3 block,
                         std::function<void(uint3 blockIndex)> runBlock);

/// The same for a kernel that gets the memory of its device, and of the host that is mapped to it, and calls
/// runBlocks() itself. Also returns cudaErrorInvalidValue if a block has more than maxThreads threads, and
/// cudaErrorInvalidDeviceFunction without a kernel.
using Kernel = std::function<void(std::span<const Allocation> memory)>;
cudaError_t launchKernel(cudaStream_t stream, dim3 grid, dim3 block, unsigned maxThreads, Kernel kernel);

/// To be called only within a Kernel.
void runBlocks(dim3 grid, const std::function<void(uint3 blockIndex)>& runBlock);

/// Queues a function of the host like a kernel. It must not throw. Returns the same errors.
cudaError_t launchHost(cudaStream_t stream, std::function<void()> function);

}  // namespace substitute
