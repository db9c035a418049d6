// SPDX-License-Identifier: Apache-2.0
// There is nothing to profile.
#pragma once
#include "cuda_runtime_api.h"

inline cudaError_t cudaProfilerStart() { return cudaSuccess; }
