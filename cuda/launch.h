// SPDX-License-Identifier: Apache-2.0
// Passes over a picture on a CUDA device: uploads a scene, and returns one sample of every pixel and its
// cost.
#pragma once
#include <cuda_runtime_api.h>

#include <glm/vec4.hpp>
#include <span>

#include "cuda/device_scene.h"
#include "renderer/data/scene.h"
#include "renderer/kernel/rng.h"

namespace scolopax::cuda {

/// As kernel::RenderPixel, with device pointers.
struct DevicePass {
  kernel::SceneView scene;
  kernel::SampleNumber number;
  glm::vec4* pixels;
  kernel::SampleCost* cost;
};

/// Starts a pass without waiting for it.
using LaunchFunction = cudaError_t (*)(const DevicePass&);

/// The kernels of one integrator for a scene. Each integrator is compiled in a file of its own. With `plain`,
/// they can render only what a PlainSceneView can represent.
template <class Integrator>
LaunchFunction chooseLaunch(const Scene& scene, bool plain);

class Passes {
 public:
  /// `view` is that of a render plan of `scene`. `counting`: sum up the costs of samples.
  Passes(const Scene& scene, const kernel::SceneView& view, bool counting);
  /// Renders one sample of every pixel into width x height linear premultiplied RGBA values.
  void render(const kernel::SampleNumber& number, std::span<glm::vec4> pixels);
  /// Costs of all passes so far, one per pixel; empty unless counting.
  std::vector<kernel::SampleCost> cost() const;

 private:
  LaunchFunction launch_;
  DeviceScene scene_;
  DeviceBuffer<glm::vec4> pixels_;
  DeviceBuffer<kernel::SampleCost> cost_;
};

}  // namespace scolopax::cuda
