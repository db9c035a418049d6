// SPDX-License-Identifier: Apache-2.0
// The paper's Listing 4 as printed, to count what it costs beside the kernels that stem from it.
#pragma once
#include <cuda_runtime_api.h>

#include "cuda/launch.h"

namespace scolopax::test {

/// A scene with the paper's majorants: one float for every macrocell and visible channel.
struct PrintedView : kernel::PlainSceneView {
  const float* printedMajorants;
};

/// Starts the kernel that renders a band of a plain scene by the printed listing, in blend mode density. Both
/// pointers of `band.scene` and `majorants`: to device memory.
cudaError_t launchPrinted(const cuda::DeviceBand& band, const float* majorants, bool lit,
                          cudaStream_t stream);

}  // namespace scolopax::test
