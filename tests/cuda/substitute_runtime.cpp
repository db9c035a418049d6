// SPDX-License-Identifier: Apache-2.0
// The CUDA runtime as tests need it: device memory is host memory with bounds that are known.
#include "tests/cuda/substitute_runtime.h"

#include <tbb/parallel_for.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

namespace {

std::map<const std::byte*, std::size_t> heap;  // address -> size in bytes
std::size_t used = 0, limit = std::size_t(1) << 32;
cudaError_t lastError = cudaSuccess;
cudaError_t deviceCountResult = cudaSuccess;
int devices = 1;
std::mutex faultMutex;  // kernels run in parallel; everything else is called from one thread
std::string fault;
bool faultPending = false;

cudaError_t returned(cudaError_t error) {
  if (error != cudaSuccess) lastError = error;
  return error;
}

bool onDevice(const void* memory, std::size_t sizeBytes) {
  const auto begin = static_cast<const std::byte*>(memory);
  auto allocation = heap.upper_bound(begin);
  if (allocation == heap.begin()) return false;
  --allocation;
  return std::size_t(begin - allocation->first) + sizeBytes <= allocation->second;
}

}  // namespace

namespace substitute {

std::vector<Allocation> allocations() {
  std::vector<Allocation> all;
  for (const auto& [begin, sizeBytes] : heap) all.push_back({begin, sizeBytes});
  return all;
}

void limitMemory(std::size_t sizeBytes) { limit = sizeBytes; }

void setDeviceCount(cudaError_t result, int count) {
  deviceCountResult = result;
  devices = count;
}

void reportFault(const std::string& what) {
  const std::lock_guard lock(faultMutex);
  fault = what;
  faultPending = true;
}

std::string lastFault() { return fault; }

cudaError_t runBlocks(dim3 grid, dim3 block, const std::function<void(uint3 blockIndex)>& runBlock) {
  const std::size_t threads = std::size_t(block.x) * block.y * block.z;
  const bool fits = threads >= 1 && threads <= 1024 && block.z <= 64 && grid.x >= 1 && grid.y >= 1 &&
                    grid.z >= 1 && grid.y <= 65535 && grid.z <= 65535;
  if (!fits) return returned(cudaErrorInvalidConfiguration);
  tbb::parallel_for(std::size_t(0), std::size_t(grid.x) * grid.y * grid.z, [&](std::size_t i) {
    runBlock({unsigned(i % grid.x), unsigned(i / grid.x % grid.y), unsigned(i / grid.x / grid.y)});
  });
  return cudaSuccess;
}

}  // namespace substitute

extern "C" {

cudaError_t cudaGetDeviceCount(int* count) {
  if (deviceCountResult == cudaSuccess) *count = devices;
  return returned(deviceCountResult);
}

cudaError_t cudaMalloc(void** memory, size_t sizeBytes) {
  // No rounding up of the size: a sanitizer sees the first byte beyond it.
  if (sizeBytes > limit - used || posix_memalign(memory, 256, sizeBytes) != 0)
    return returned(cudaErrorMemoryAllocation);
  std::memset(*memory, 0xcd, sizeBytes);
  heap[static_cast<std::byte*>(*memory)] = sizeBytes;
  used += sizeBytes;
  return cudaSuccess;
}

cudaError_t cudaFree(void* memory) {
  if (!memory) return cudaSuccess;
  const auto allocation = heap.find(static_cast<std::byte*>(memory));
  if (allocation == heap.end()) return returned(cudaErrorInvalidValue);
  used -= allocation->second;
  heap.erase(allocation);
  std::free(memory);
  return cudaSuccess;
}

cudaError_t cudaMemset(void* memory, int value, size_t sizeBytes) {
  if (!onDevice(memory, sizeBytes)) return returned(cudaErrorInvalidValue);
  std::memset(memory, value, sizeBytes);
  return cudaSuccess;
}

cudaError_t cudaMemcpy(void* to, const void* from, size_t sizeBytes, cudaMemcpyKind kind) {
  const void* device = kind == cudaMemcpyHostToDevice ? to : from;
  const void* host = kind == cudaMemcpyHostToDevice ? from : to;
  if (!onDevice(device, sizeBytes) || onDevice(host, 1)) return returned(cudaErrorInvalidValue);
  std::memcpy(to, from, sizeBytes);
  return cudaSuccess;
}

cudaError_t cudaDeviceSynchronize() {
  return std::exchange(faultPending, false) ? returned(cudaErrorIllegalAddress) : cudaSuccess;
}

cudaError_t cudaGetLastError() { return std::exchange(lastError, cudaSuccess); }

const char* cudaGetErrorString(cudaError_t error) {
  return error == cudaErrorMemoryAllocation ? "out of memory" : "an error of the substitute runtime";
}

}  // extern "C"
