// SPDX-License-Identifier: Apache-2.0
// Computes the totals of macrocells on the device, so that an edit of a curve moves only the channel's table.
#pragma once
#include <cuda_runtime_api.h>

#include "renderer/kernel/majorants.h"

namespace scolopax::cuda {

/// Starts the kernel that writes MajorantView::totals and, unless it is null, MajorantView::active, one per
/// cell, from the other arrays of `majorants`. All are in device memory.
cudaError_t rebuildTotals(const kernel::MajorantView& majorants, kernel::TotalCode* totals,
                          std::uint32_t* active, cudaStream_t stream);

}  // namespace scolopax::cuda
