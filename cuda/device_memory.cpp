// SPDX-License-Identifier: Apache-2.0
#include "cuda/device_memory.h"

#include <bit>

#include "cuda/check.h"

namespace scolopax::cuda {
namespace {

constexpr std::size_t kSmallestBlock = 4096;
/// Larger blocks hold volumes, which are seldom given back.
constexpr std::size_t kLargestKept = std::size_t{16} << 20;
constexpr std::size_t kMostKept = std::size_t{256} << 20;

/// Sizes of small blocks are powers of two, so that they fit again.
std::size_t blockSize(std::size_t bytes) {
  return bytes > kLargestKept ? bytes : std::bit_ceil(std::max(bytes, kSmallestBlock));
}

}  // namespace

DeviceMemory::~DeviceMemory() { freeKept(); }

DeviceBytes DeviceMemory::allocate(std::size_t bytes) {
  if (bytes == 0) return nullptr;
  const std::size_t size = blockSize(bytes);
  std::byte* block = nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = kept_.find(size); found != kept_.end()) {
      block = found->second;
      kept_.erase(found);
      keptBytes_ -= size;
    }
  }
  while (!block) {
    void* memory = nullptr;
    const cudaError_t result = cudaMalloc(&memory, size);
    if (result == cudaErrorMemoryAllocation && (freeKept() || makeRoom_())) {
      cudaGetLastError();
      continue;
    }
    check(result, "allocating device memory");
    block = static_cast<std::byte*>(memory);
  }
  {
    const std::lock_guard lock(mutex_);
    used_ += size;
  }
  return {block, [memory = weak_from_this(), size](std::byte* given) {
            if (const auto owner = memory.lock())
              owner->giveBack(given, size);
            else
              cudaFree(given);
          }};
}

std::size_t DeviceMemory::reserved() const {
  const std::lock_guard lock(mutex_);
  return used_ + keptBytes_;
}

void DeviceMemory::giveBack(std::byte* block, std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    used_ -= bytes;
    if (bytes <= kLargestKept && keptBytes_ + bytes <= kMostKept) {
      kept_.emplace(bytes, block);
      keptBytes_ += bytes;
      return;
    }
  }
  cudaFree(block);
}

bool DeviceMemory::freeKept() {
  std::multimap<std::size_t, std::byte*> blocks;
  {
    const std::lock_guard lock(mutex_);
    blocks.swap(kept_);
    keptBytes_ = 0;
  }
  for (const auto& [bytes, block] : blocks) cudaFree(block);
  return !blocks.empty();
}

}  // namespace scolopax::cuda
