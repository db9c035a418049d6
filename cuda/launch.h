// SPDX-License-Identifier: Apache-2.0
// Starts the kernel that renders a band of a picture: some rows of one sample.
#pragma once
#include <cuda_runtime_api.h>

#include <glm/vec4.hpp>

#include "renderer/data/instances.h"
#include "renderer/kernel/rng.h"
#include "renderer/kernel/sample_records.h"

namespace scolopax::cuda {

/// All pointers are to device memory. The arrays begin at the first pixel of the band.
struct DeviceBand {
  kernel::SceneView scene;
  kernel::SampleNumber number;
  int firstRow, rows;
  glm::vec4* pixels;                        ///< as kernel::RenderPixel::pass
  kernel::SampleCost* cost = nullptr;       ///< null if costs are not counted
  kernel::FirstCollision* first = nullptr;  ///< null if first collisions are not recorded
};

/// Starts the kernel on a stream of the current device, without waiting for it.
using LaunchFunction = cudaError_t (*)(const DeviceBand&, cudaStream_t);

/// The kernels of one integrator. With PlainSceneView, they can render only what isPlain() allows.
template <class Integrator, class View>
LaunchFunction launchOf(const Instance& instance);

/// Whether a band needs no more than kernels of plain scenes.
bool isPlain(const DeviceBand& band, const kernel::ChannelView* hostChannels);

/// The kernel that renders the band. `hostChannels`: the channels of its scene, in host memory.
LaunchFunction chooseLaunch(const Instance& instance, const DeviceBand& band,
                            const kernel::ChannelView* hostChannels);

}  // namespace scolopax::cuda
