// SPDX-License-Identifier: Apache-2.0
#include "cuda/launch.h"

#include "renderer/core/error.h"
#include "renderer/data/instances.h"

namespace scolopax::cuda {
namespace {

bool isPlain(const kernel::SceneView& view) {
  for (int n = 0; n < view.channelCount; ++n)
    if (view.hasFactor(n)) return false;
  return true;
}

const kernel::SceneView& checked(const kernel::SceneView& view) {
  for (int n = 0; n < view.channelCount; ++n)
    if (view.channels[n].field.filter != kernel::Filter::trilinear)
      throw Error(ErrorCode::unsupported, "cuda: interpolation other than trilinear");
  if (view.cutsAtVoxels())
    throw Error(ErrorCode::unsupported, "cuda: quadrature from one face of voxel cells to the next (step 0)");
  if (view.surfaces) throw Error(ErrorCode::unsupported, "cuda: surfaces (isovalues and peaks)");
  return view;
}

}  // namespace

Passes::Passes(const Scene& scene, const kernel::SceneView& view, bool counting)
    : launch_(visitIntegrator(
          scene,
          [&](auto type) { return chooseLaunch<typename decltype(type)::type>(scene, isPlain(view)); })),
      scene_(checked(view)),
      pixels_(std::size_t(view.width) * std::size_t(view.height)),
      cost_(counting ? pixels_.count() : 0) {
  cost_.fillWithZeros();
}

void Passes::render(const kernel::SampleNumber& number, std::span<glm::vec4> pixels) {
  check(launch_({scene_.view(), number, pixels_.data(), cost_.data()}), "starting a kernel");
  check(cudaDeviceSynchronize(), "rendering");
  pixels_.copyTo(pixels);
}

std::vector<kernel::SampleCost> Passes::cost() const {
  std::vector<kernel::SampleCost> cost(cost_.count());
  cost_.copyTo(cost);
  return cost;
}

}  // namespace scolopax::cuda
