// SPDX-License-Identifier: Apache-2.0
// Results of the CUDA runtime become exceptions here.
#pragma once
#include <cuda_runtime_api.h>

namespace scolopax::cuda {

/// Throws Error(tooLarge) when the device's memory is used up and Error(device) for any other failure;
/// `doing` says what failed: "copying 64 bytes to the device".
void check(cudaError_t result, const char* doing);

/// Devices that can be used; 0 without a driver, with one too old, or when anything else is wrong.
int deviceCount();

}  // namespace scolopax::cuda
