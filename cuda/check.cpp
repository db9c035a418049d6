// SPDX-License-Identifier: Apache-2.0
#include "cuda/check.h"

#include "renderer/core/error.h"

namespace scolopax::cuda {

void check(cudaError_t result, const char* doing) {
  if (result == cudaSuccess) return;
  cudaGetLastError();  // clears the error: otherwise, the next call would report it again
  throw Error(result == cudaErrorMemoryAllocation ? ErrorCode::tooLarge : ErrorCode::device,
              std::string("CUDA: ") + doing + " failed: " + cudaGetErrorString(result));
}

}  // namespace scolopax::cuda
