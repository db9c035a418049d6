// SPDX-License-Identifier: Apache-2.0
#include <cuda_runtime.h>

#include "cuda/rebuild_totals.h"

namespace scolopax::cuda {

inline constexpr unsigned kThreads = 128;

struct Rebuild {
  kernel::MajorantView majorants;
  kernel::TotalCode* totals;
  std::uint32_t* active;
  unsigned cells;
};

__global__ void __launch_bounds__(kThreads) rebuildCells(Rebuild rebuild) {
  const unsigned cell = blockIdx.x * blockDim.x + threadIdx.x;
  if (cell >= rebuild.cells) return;
  const glm::ivec3 cells = rebuild.majorants.cells;
  const glm::ivec3 blocks = (cells + (kernel::kBlockEdge - 1)) / kernel::kBlockEdge;
  const int x = int(cell % unsigned(cells.x)) / kernel::kBlockEdge;
  const int y = int(cell / unsigned(cells.x) % unsigned(cells.y)) / kernel::kBlockEdge;
  const int z = int(cell / unsigned(cells.x) / unsigned(cells.y)) / kernel::kBlockEdge;
  const int radius =
      rebuild.majorants
          .radii[(std::size_t(z) * std::size_t(blocks.y) + std::size_t(y)) * std::size_t(blocks.x) +
                 std::size_t(x)];
  const kernel::MajorantView& majorants = rebuild.majorants;
  rebuild.totals[cell] = majorants.codeOf(cell, radius);
  if (rebuild.active)
    rebuild.active[cell] =
        kernel::activeChannels(majorants.tables, majorants.tableCount, majorants.intervalsOf(cell));
}

cudaError_t rebuildTotals(const kernel::MajorantView& majorants, kernel::TotalCode* totals,
                          std::uint32_t* active, cudaStream_t stream) {
  const glm::uvec3 cells(majorants.cells);
  Rebuild rebuild{
      .majorants = majorants, .totals = totals, .active = active, .cells = cells.x * cells.y * cells.z};
  void* arguments[] = {&rebuild};
  return cudaLaunchKernel(rebuildCells, dim3((rebuild.cells + kThreads - 1) / kThreads), dim3(kThreads),
                          arguments, 0, stream);
}

}  // namespace scolopax::cuda
