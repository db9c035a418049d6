// SPDX-License-Identifier: Apache-2.0
// A substitute of the CUDA runtime for tests: devices, memory and errors.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "tests/cuda/substitute_state.h"

using namespace substitute;

namespace {

/// Memory filled with kPoison; null if there is none. The size is not rounded up, so that a sanitizer detects
/// an access to the first byte beyond it.
std::byte* allocate(std::size_t sizeBytes) {
  void* memory = nullptr;
  if (posix_memalign(&memory, 256, sizeBytes) != 0) return nullptr;
  std::memset(memory, int(kPoison), sizeBytes);
  return static_cast<std::byte*>(memory);
}

/// The allocation that begins at this address. Throws Failure(cudaErrorInvalidValue) if there is none.
Memory expectAllocation(const Heap& heap, const void* memory) {
  const auto allocation = heap.find(static_cast<const std::byte*>(memory));
  if (allocation == heap.end()) throw Failure{cudaErrorInvalidValue};
  return allocation->second;
}

}  // namespace

extern "C" {

cudaError_t cudaGetDeviceCount(int* count) {
  return call([&] {
    if (state().deviceCountResult != cudaSuccess) throw Failure{state().deviceCountResult};
    *count = state().deviceCount;
  });
}

cudaError_t cudaSetDevice(int device) {
  return call([&] {
    deviceOf(device);
    caller().device = device;
  });
}

cudaError_t cudaGetDevice(int* device) {
  return call([&] { *device = caller().device; });
}

cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int device) {
  return call([&] {
    const Device& found = deviceOf(device);
    *properties = {};
    const std::string name = "Substitute device " + std::to_string(device);
    std::copy(name.begin(), name.end(), properties->name);
    properties->totalGlobalMem = found.limit;
    properties->major = 7;
    properties->minor = 5;
    properties->multiProcessorCount = 4;
  });
}

cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int device) {
  return call([&] {
    deviceOf(device);
    switch (attribute) {
      case cudaDevAttrMultiProcessorCount:
        *value = 4;
        return;
      case cudaDevAttrComputeCapabilityMajor:
        *value = 7;
        return;
      case cudaDevAttrComputeCapabilityMinor:
        *value = 5;
        return;
    }
    throw Failure{cudaErrorInvalidValue};
  });
}

cudaError_t cudaMemGetInfo(size_t* freeBytes, size_t* totalBytes) {
  return call([&] {
    const Device& device = currentDevice();
    *freeBytes = device.limit - std::min(device.used, device.limit);
    *totalBytes = device.limit;
  });
}

cudaError_t cudaDeviceSynchronize() {
  return call([] {
    currentDevice();
    finishDevice(caller().device);
    surfaceFault(caller().device);
  });
}

cudaError_t cudaMalloc(void** memory, size_t sizeBytes) {
  return call([&] {
    Device& device = currentDevice();
    *memory = nullptr;
    if (sizeBytes == 0) return;
    const std::size_t available = device.limit - std::min(device.used, device.limit);
    std::byte* const begin = sizeBytes <= available ? allocate(sizeBytes) : nullptr;
    if (!begin) throw Failure{cudaErrorMemoryAllocation};
    state().deviceMemory[begin] = {sizeBytes, caller().device};
    device.used += sizeBytes;
    *memory = begin;
  });
}

cudaError_t cudaFree(void* memory) {
  return release([&] {
    if (!memory) return;
    const Memory freed = expectAllocation(state().deviceMemory, memory);
    state().freesThatWaited += finishDevice(freed.device);
    state().deviceMemory.erase(static_cast<std::byte*>(memory));
    std::free(memory);
    state().devices[std::size_t(freed.device)].used -= freed.sizeBytes;
    expectAlive(freed.device);
  });
}

cudaError_t cudaHostAlloc(void** memory, size_t sizeBytes, unsigned flags) {
  return call([&] {
    currentDevice();
    if (flags & ~unsigned(cudaHostAllocPortable | cudaHostAllocMapped)) throw Failure{cudaErrorInvalidValue};
    *memory = nullptr;
    if (sizeBytes == 0) return;
    std::byte* const begin = allocate(sizeBytes);
    if (!begin) throw Failure{cudaErrorMemoryAllocation};
    state().pinnedMemory[begin] = {sizeBytes, caller().device, (flags & cudaHostAllocMapped) != 0};
    *memory = begin;
  });
}

cudaError_t cudaHostGetDevicePointer(void** onDevice, void* memory, unsigned flags) {
  return call([&] {
    currentDevice();
    const Memory* found = allocationOf(state().pinnedMemory, memory, 1);
    if (flags != 0 || !found || !found->mapped || found->device != caller().device)
      throw Failure{cudaErrorInvalidValue};
    *onDevice = memory;
  });
}

cudaError_t cudaFreeHost(void* memory) {
  return release([&] {
    if (!memory) return;
    const Memory freed = expectAllocation(state().pinnedMemory, memory);
    state().freesThatWaited += freed.mapped
                                   ? finishDevice(freed.device)  // kernels may use it
                                   : finishUsersOf({static_cast<std::byte*>(memory), freed.sizeBytes});
    state().pinnedMemory.erase(static_cast<std::byte*>(memory));
    std::free(memory);
    expectAlive(freed.device);
  });
}

cudaError_t cudaMemset(void* memory, int value, size_t sizeBytes) {
  return call([&] {
    currentDevice();
    if (sizeBytes == 0) return;
    expectOnDevice(memory, sizeBytes, caller().device);
    finishBlockingStreams(caller().device);
    std::memset(memory, value, sizeBytes);
  });
}

cudaError_t cudaMemcpy(void* to, const void* from, size_t sizeBytes, cudaMemcpyKind kind) {
  return call([&] {
    currentDevice();
    const bool upload = kind == cudaMemcpyHostToDevice;
    if (!upload && kind != cudaMemcpyDeviceToHost) throw Failure{cudaErrorInvalidMemcpyDirection};
    if (sizeBytes == 0) return;
    expectOnDevice(upload ? to : from, sizeBytes, caller().device);
    if (allocationOf(state().deviceMemory, upload ? from : to, 1)) throw Failure{cudaErrorInvalidValue};
    finishBlockingStreams(caller().device);
    surfaceFault(caller().device);
    std::memcpy(to, from, sizeBytes);
    if (upload) state().bytesToDevice += sizeBytes;
  });
}

cudaError_t cudaPeekAtLastError() {
  cudaError_t error = cudaSuccess;
  locked([&] {
    const bool lost = state().devices[std::size_t(caller().device)].lost;
    error = lost ? cudaErrorIllegalAddress : caller().lastError;
  });
  return error;
}

cudaError_t cudaGetLastError() {
  const cudaError_t error = cudaPeekAtLastError();
  caller().lastError = cudaSuccess;
  return error;
}

const char* cudaGetErrorString(cudaError_t error) {
  return error == cudaErrorMemoryAllocation ? "out of memory" : "an error of the substitute runtime";
}

}  // extern "C"
