// SPDX-License-Identifier: Apache-2.0
// What tests may ask of the substitute CUDA runtime beside CUDA's own interface.
#pragma once
#include <cuda_runtime_api.h>

#include <functional>
#include <string>
#include <vector>

namespace substitute {

struct Allocation {
  const std::byte* begin;
  std::size_t sizeBytes;
};
/// Of device memory, by address.
std::vector<Allocation> allocations();

/// From now on an allocation beyond this many bytes in all fails.
void limitMemory(std::size_t sizeBytes);

/// What cudaGetDeviceCount returns from now on; a failure leaves its argument untouched.
void setDeviceCount(cudaError_t result, int count);

/// The next cudaDeviceSynchronize returns cudaErrorIllegalAddress.
void reportFault(const std::string& what);
/// What the last kernel did wrong; empty when none did.
std::string lastFault();

/// Runs every block of a grid, in parallel, after the checks that a launch makes.
cudaError_t runBlocks(dim3 grid, dim3 block, const std::function<void(uint3 blockIndex)>& runBlock);

}  // namespace substitute
