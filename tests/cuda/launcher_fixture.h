// SPDX-License-Identifier: Apache-2.0
// For tests of the CUDA launcher on the substitute runtime.
#pragma once
#include <gtest/gtest.h>

#include <cstring>

#include "tests/cuda/device_scenes.h"
#include "tests/cuda/substitute_runtime.h"

namespace scolopax::test {

/// Every test begins and ends with a runtime in which nothing is in use.
class CudaLauncher : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(substitute::reset()); }
  void TearDown() override {
    EXPECT_EQ(substitute::leaks(), substitute::Leaks());
    EXPECT_TRUE(substitute::reset());
  }
};

/// One channel, so that little is uploaded.
inline Scene smallScene(const Volume& volume) {
  Scene scene = obliqueScene(volume, 16, 24);
  for (std::size_t i = 1; i < scene.channels.size(); ++i) scene.channels[i].visible = false;
  return scene;
}

inline Image rendered(Renderer& renderer, const Scene& scene, int samples = 2) {
  renderer.setScene(scene);
  for (int i = 0; i < samples; ++i) EXPECT_TRUE(renderer.renderSample(kNever));
  return renderer.image();
}

inline void expectSamePicture(const Image& found, const Image& expected) {
  ASSERT_EQ(found.pixels.size(), expected.pixels.size());
  EXPECT_EQ(std::memcmp(found.pixels.data(), expected.pixels.data(), found.pixels.size() * sizeof(glm::vec4)),
            0);
}

inline Image pictureOfTheCpu(const std::shared_ptr<const Volume>& volume, const Scene& scene,
                             int samples = 2) {
  return rendered(*makeCpuRenderer(volume, 1), scene, samples);
}

}  // namespace scolopax::test
