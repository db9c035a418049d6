// SPDX-License-Identifier: Apache-2.0
// The kernels for CUDA: one thread per pixel, and one instance for every combination that a scene can use.
// The instances of each integrator are compiled in a file of its own, kernels_*.cu.
#pragma once
#include <cuda_runtime.h>

#include "cuda/launch.h"
#include "renderer/data/instances.h"
#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/render_pixel.h"
#include "renderer/kernel/shade.h"

namespace scolopax::cuda {

/// A warp is a tile of 8x4 pixels: neighbouring rays share voxels and macrocells.
inline constexpr unsigned kBlockWidth = 8, kBlockHeight = 16;

template <class Integrator, class Blend, class Lighting, class View>
__global__ void __launch_bounds__(kBlockWidth* kBlockHeight)
    renderPixels(kernel::RenderPixel<Integrator, Blend, Lighting, View> render) {
  const int x = int(blockIdx.x * blockDim.x + threadIdx.x);
  const int y = int(blockIdx.y * blockDim.y + threadIdx.y);
  if (x < render.scene.width && y < render.scene.height) render(y * render.scene.width + x);
}

template <class Integrator, class Blend, class Lighting, class View>
cudaError_t launch(const DevicePass& pass) {
  kernel::RenderPixel<Integrator, Blend, Lighting, View> render{View{pass.scene}, pass.number, pass.pixels,
                                                                pass.cost};
  const dim3 block(kBlockWidth, kBlockHeight);
  const dim3 grid((unsigned(pass.scene.width) + block.x - 1) / block.x,
                  (unsigned(pass.scene.height) + block.y - 1) / block.y);
  void* arguments[] = {&render};
  return cudaLaunchKernel(renderPixels<Integrator, Blend, Lighting, View>, grid, block, arguments, 0,
                          nullptr);
}

template <class Integrator>
LaunchFunction chooseLaunch(const Scene& scene, bool plain) {
  return visitBlendAndLight(scene, [&](auto blend, auto lighting) -> LaunchFunction {
    using Blend = typename decltype(blend)::type;
    using Lighting = typename decltype(lighting)::type;
    return plain ? launch<Integrator, Blend, Lighting, kernel::PlainSceneView>
                 : launch<Integrator, Blend, Lighting, kernel::SceneView>;
  });
}

}  // namespace scolopax::cuda
