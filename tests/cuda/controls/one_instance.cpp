// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/controls/one_instance.h"

#include <cstring>

#include "tests/cuda/device_scenes.h"
#include "tests/cuda/uploaded_plan.h"

namespace scolopax::test {

int differenceOfOneInstance() {
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 21, 35);  // not a multiple of the blocks of threads
  scene.method = Method::syncDda;
  scene.shading = scene.shadows = true;
  const UploadedPlan uploaded(volume, scene);
  std::vector<glm::vec4> found(std::size_t(scene.width) * std::size_t(scene.height));
  const ExactPixels pixels(found.size());
  cuda::check(oneInstance()(uploaded.band(pixels.data()), nullptr), "starting a kernel");
  cuda::check(cudaDeviceSynchronize(), "rendering");
  pixels.copyTo(found);

  const auto cpu = makeCpuRenderer(volume, 1);
  cpu->setScene(scene);
  cpu->renderSample(kNever);
  const Image expected = cpu->image();
  int different = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    different += std::memcmp(&found[i], &expected.pixels[i], sizeof found[i]) != 0;
  return different;
}

}  // namespace scolopax::test
