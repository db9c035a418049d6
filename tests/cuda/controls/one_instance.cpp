// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/controls/one_instance.h"

#include <cstring>

#include "renderer/renderer.h"
#include "tests/cuda/device_scenes.h"

namespace scolopax::test {

int differenceOfOneInstance() {
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 21, 35);  // of no size that blocks of threads fill
  scene.method = Method::syncDda;
  scene.shading = scene.shadows = true;
  const RenderPlan plan(volume, scene);
  const cuda::DeviceScene uploaded(plan.view());
  const cuda::DeviceBuffer<glm::vec4> pixels(std::size_t(scene.width) * std::size_t(scene.height));
  cuda::check(oneInstance()({uploaded.view(), sampleNumber(scene.sampling, 0), pixels.data(), nullptr}),
              "starting a kernel");
  cuda::check(cudaDeviceSynchronize(), "rendering");
  std::vector<glm::vec4> found(pixels.count());
  pixels.copyTo(found);

  const auto cpu = makeCpuRenderer(volume, 1);
  cpu->setScene(scene);
  const std::atomic<bool> never = false;
  cpu->renderSample(never);
  const Image expected = cpu->image();
  int different = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    different += std::memcmp(&found[i], &expected.pixels[i], sizeof found[i]) != 0;
  return different;
}

}  // namespace scolopax::test
