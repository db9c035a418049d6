// SPDX-License-Identifier: Apache-2.0
// What tests may ask of the substitute CUDA runtime beside CUDA's own interface (substitute_state.h tells how
// it works). All functions may be called from several threads, but not from within a kernel.
#pragma once
#include <cuda_runtime_api.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace substitute {

/// Back to the state at the program's start: one device of 4 GiB, no failures, all counts 0; for every
/// thread, the current device is 0 and there is no last error. Returns false, and changes nothing, if leaks()
/// finds anything.
[[nodiscard]] bool reset();

// Devices and their memory.

/// What cudaGetDeviceCount returns from now on; a failure leaves its argument untouched. Devices beyond the
/// count cannot be used, but what was made on them can still be freed.
void setDeviceCount(cudaError_t result, int count);

/// From now on an allocation beyond this many bytes in all fails: on each device, or on one that
/// exists.
void limitMemory(std::size_t sizeBytes);
void limitMemory(int device, std::size_t sizeBytes);

struct Allocation {
  const std::byte* begin;
  std::size_t sizeBytes;
  int device;
};
/// Of device memory, by address.
std::vector<Allocation> allocations();

/// What is in the bytes of new memory, of the host memory that a queued copy will write, and of the device
/// memory that a queued copy will write next.
inline constexpr std::byte kPoison{0xcd};

/// How many of each are alive, on all devices.
struct Leaks {
  std::size_t deviceAllocations = 0, pinnedAllocations = 0, streams = 0, events = 0;
  bool operator==(const Leaks&) const = default;
};
Leaks leaks();

/// How often memory was freed before the work on it was waited for: device memory while anything was queued
/// on its device, pinned memory while a copy of it was. cudaFree and cudaFreeHost then wait themselves, as
/// CUDA's do; but NVIDIA does not promise that, and it stops every stream.
std::size_t freesThatWaited();

/// Copied from the host to all devices so far; a queued copy counts when it runs. Kernels' arguments do not
/// count.
std::size_t bytesToDevice();

// Failures.

/// Calls of the runtime so far: of every function that can fail but cudaGetLastError and cudaPeekAtLastError;
/// launchBlocks, launchKernel and launchHost count, as launches do.
std::size_t callCount();

/// The n-th call from now, the next being the first, returns `error` and has no effect; but calls that free
/// something do free it, because nobody would try a second time. Replaces what was asked for before; n = 0
/// takes it back.
void failCall(std::size_t n, cudaError_t error);

/// From now on every call for this device, its streams, events or memory returns cudaErrorIllegalAddress,
/// cudaSetDevice too; cudaGetLastError does so while it is the current device. What is queued on it never
/// runs, and nothing waits for it. Calls that free something return the error too, but do free it.
void loseDevice(int device);

/// The next call that waits for, or asks about, work of the device returns cudaErrorIllegalAddress. The
/// device is that of the kernel that is running, or else the current one. May be called from within a kernel.
void reportFault(const std::string& what);
/// What the last kernel did wrong; empty when none did.
std::string lastFault();

// Kernels. They run with the runtime locked: they must not call it.

/// Launches a kernel: runBlock() is called for every block, in parallel and in a random order, when its turn
/// comes. Returns what cudaLaunchKernel does: cudaErrorInvalidResourceHandle for a stream of another device
/// than the current one, cudaErrorInvalidConfiguration for sizes that no device can run.
cudaError_t launchBlocks(cudaStream_t stream, dim3 grid, dim3 block,
                         std::function<void(uint3 blockIndex)> runBlock);

/// The same for a kernel that is given its device's allocations, by address, and calls runBlocks() itself.
/// Returns cudaErrorInvalidValue if a block has more than maxThreads threads, and
/// cudaErrorInvalidDeviceFunction without a kernel.
using Kernel = std::function<void(std::span<const Allocation> memory)>;
cudaError_t launchKernel(cudaStream_t stream, dim3 grid, dim3 block, unsigned maxThreads, Kernel kernel);

/// Only within a Kernel.
void runBlocks(dim3 grid, const std::function<void(uint3 blockIndex)>& runBlock);

/// Queues a function of the host, which must not throw, where a kernel could stand. Returns the same.
cudaError_t launchHost(cudaStream_t stream, std::function<void()> function);

}  // namespace substitute
