// SPDX-License-Identifier: Apache-2.0
// Prints what the first CUDA device is, as JSON; fails if there is none.
#include <cuda_runtime_api.h>

#include <cstdio>

int main() {
  int count = 0, driver = 0, runtime = 0;
  cudaDeviceProp device{};
  cudaError_t result = cudaGetDeviceCount(&count);
  if (result == cudaSuccess && count > 0) result = cudaGetDeviceProperties(&device, 0);
  if (result != cudaSuccess || count == 0) {
    std::fprintf(stderr, "%s\n", result == cudaSuccess ? "none found" : cudaGetErrorString(result));
    return 1;
  }
  cudaDriverGetVersion(&driver);
  cudaRuntimeGetVersion(&runtime);
  std::printf(
      "{\"name\": \"%s\", \"capability\": \"%d.%d\", \"multiprocessors\": %d, \"memoryBytes\": %zu, "
      "\"cacheBytes\": %d, \"driver\": %d, \"runtime\": %d}\n",
      device.name, device.major, device.minor, device.multiProcessorCount, device.totalGlobalMem,
      device.l2CacheSize, driver, runtime);
}
