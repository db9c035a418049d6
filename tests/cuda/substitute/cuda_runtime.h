// SPDX-License-Identifier: Apache-2.0
// The kernel language for compilers without CUDA's headers. For clang in CUDA mode: attributes and special
// registers. For a plain C++ compiler: kernels are functions, which cudaLaunchKernel calls.
#pragma once
// Included first, because clang's wrapper of <new> needs the declaration of malloc.
#include <stdlib.h>

#include "cuda_runtime_api.h"

#if defined(__CUDA__)

#define __host__ __attribute__((host))
#define __device__ __attribute__((device))
#define __global__ __attribute__((global))
#define __shared__ __attribute__((shared))
#define __launch_bounds__(...) __attribute__((launch_bounds(__VA_ARGS__)))
#define __CUDACC__ 1
#define CUDA_VERSION 11000  // needed by GLM, otherwise unused

// Reading a member reads the register.
#define SUBSTITUTE_REGISTER(name)                                                        \
  struct Substitute_##name {                                                             \
    struct X {                                                                           \
      __device__ operator unsigned() const { return __nvvm_read_ptx_sreg_##name##_x(); } \
    } x;                                                                                 \
    struct Y {                                                                           \
      __device__ operator unsigned() const { return __nvvm_read_ptx_sreg_##name##_y(); } \
    } y;                                                                                 \
  };
SUBSTITUTE_REGISTER(tid)
SUBSTITUTE_REGISTER(ctaid)
SUBSTITUTE_REGISTER(ntid)
#undef SUBSTITUTE_REGISTER
extern const __device__ __attribute__((weak)) Substitute_tid threadIdx;
extern const __device__ __attribute__((weak)) Substitute_ctaid blockIdx;
extern const __device__ __attribute__((weak)) Substitute_ntid blockDim;

template <class Kernel>
cudaError_t cudaLaunchKernel(Kernel* kernel, dim3 grid, dim3 block, void** arguments, size_t sharedBytes,
                             cudaStream_t stream) {
  return cudaLaunchKernel(reinterpret_cast<const void*>(kernel), grid, block, arguments, sharedBytes, stream);
}

#else

#include <functional>
#include <tuple>
#include <utility>

#define __host__
#define __device__
#define __global__
#define __launch_bounds__(...)

inline thread_local uint3 threadIdx, blockIdx;
inline thread_local dim3 blockDim;

namespace substitute {
// As in substitute_runtime.h.
cudaError_t launchBlocks(cudaStream_t stream, dim3 grid, dim3 block,
                         std::function<void(uint3 blockIndex)> runBlock);
}  // namespace substitute

template <class... Arguments>
cudaError_t cudaLaunchKernel(void (*kernel)(Arguments...), dim3 grid, dim3 block, void** arguments, size_t,
                             cudaStream_t stream) {
  // The kernel runs later, with copies.
  const auto values = [&]<std::size_t... kIndex>(std::index_sequence<kIndex...>) {
    return std::tuple<Arguments...>(*static_cast<const Arguments*>(arguments[kIndex])...);
  }
  (std::index_sequence_for<Arguments...>());
  return substitute::launchBlocks(stream, grid, block, [kernel, block, values](uint3 index) {
    blockIdx = index;
    blockDim = block;
    for (unsigned z = 0; z < block.z; ++z)
      for (unsigned y = 0; y < block.y; ++y)
        for (unsigned x = 0; x < block.x; ++x) {
          threadIdx = {x, y, z};
          std::apply(kernel, values);
        }
  });
}

#endif
