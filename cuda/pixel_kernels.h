// SPDX-License-Identifier: Apache-2.0
// The kernels for CUDA: one thread per pixel, and one instance for every combination that a pass can use. The
// instances of each integrator are compiled in two files of its own (kernels.cmake): for plain scenes, and
// for all.
#pragma once
#include <cuda_runtime.h>

#include <type_traits>

#include "cuda/launch.h"
#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/render_pixel.h"
#include "renderer/kernel/shade.h"

namespace scolopax::cuda {

/// A warp is a tile of 8x4 pixels: neighbouring rays share voxels and macrocells.
inline constexpr unsigned kBlockWidth = 8, kBlockHeight = 16;

template <class Integrator, class Blend, class Lighting, class View>
struct RenderBand {
  kernel::RenderPixel<Integrator, Blend, Lighting, View> render;
  int firstRow, rows;
};

/// Blocks that a multiprocessor must be able to run at once; 0 leaves that to the compiler, which spills
/// registers to local memory so that more blocks fit. Kernels of plain scenes may instead take every register
/// that there is: those of quadrature with light then spill nothing (tests/cuda/check_resources.py).
template <class View>
inline constexpr unsigned kBlocksAtOnce = std::is_base_of_v<kernel::PlainSceneView, View> ? 1 : 0;

template <class Integrator, class Blend, class Lighting, class View>
__global__ void __launch_bounds__(kBlockWidth* kBlockHeight, kBlocksAtOnce<View>)
    renderPixels(RenderBand<Integrator, Blend, Lighting, View> band) {
  const int width = band.render.scene.width;
  const int x = int(blockIdx.x * blockDim.x + threadIdx.x);
  const int row = int(blockIdx.y * blockDim.y + threadIdx.y);
  if (x < width && row < band.rows) band.render((band.firstRow + row) * width + x, row * width + x);
}

/// `view`: the band's scene.
template <class Integrator, class Blend, class Lighting, class View>
cudaError_t launchView(const View& view, const DeviceBand& given, cudaStream_t stream) {
  RenderBand<Integrator, Blend, Lighting, View> band{.render = {.scene = view,
                                                                .number = given.number,
                                                                .pass = given.pixels,
                                                                .cost = given.cost,
                                                                .first = given.first},
                                                     .firstRow = given.firstRow,
                                                     .rows = given.rows};
  const dim3 block(kBlockWidth, kBlockHeight);
  const dim3 grid((unsigned(given.scene.width) + block.x - 1) / block.x,
                  (unsigned(given.rows) + block.y - 1) / block.y);
  void* arguments[] = {&band};
  return cudaLaunchKernel(renderPixels<Integrator, Blend, Lighting, View>, grid, block, arguments, 0, stream);
}

template <class Integrator, class Blend, class Lighting, class View>
cudaError_t launch(const DeviceBand& given, cudaStream_t stream) {
  return launchView<Integrator, Blend, Lighting>(View{given.scene}, given, stream);
}

template <class Integrator, class View>
LaunchFunction launchOf(const Instance& instance) {
  return visitBlendAndLight(instance, [](auto blend, auto lighting) -> LaunchFunction {
    return launch<Integrator, typename decltype(blend)::type, typename decltype(lighting)::type, View>;
  });
}

}  // namespace scolopax::cuda
