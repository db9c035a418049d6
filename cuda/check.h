// SPDX-License-Identifier: Apache-2.0
// Turns errors of the CUDA runtime into exceptions.
#pragma once
#include <cuda_runtime_api.h>

namespace scolopax::cuda {

/// Throws Error(tooLarge) if the device is out of memory, and Error(device) for any other failure. `doing`
/// names the operation that failed: "copying 64 bytes to the device".
void check(cudaError_t result, const char* doing);

}  // namespace scolopax::cuda
