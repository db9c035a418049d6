// SPDX-License-Identifier: Apache-2.0
// The compiled kernels themselves: all there, and every access of theirs checked.
#include <gmock/gmock.h>

#include "renderer/data/instances.h"
#include "tests/cuda/device_scenes.h"
#include "tests/cuda/ptx_machine.h"
#include "tests/cuda/substitute_runtime.h"

namespace scolopax {
namespace {

using namespace test;

TEST(PtxKernels, AreOneForEveryMethodBlendModeAndLight) {
  EXPECT_EQ(ptx::kernelNames().size(), std::size(kMethods) * std::size(kBlendModes) * 4);
}

TEST(PtxKernels, AreCaughtReadingAndWritingWhereTheyMayNot) {
  const auto volume = mixedVolume();
  const Scene scene = obliqueScene(*volume, 8, 8);
  RenderPlan plan(volume);
  plan.update(scene);
  const auto faultOf = [&](kernel::SceneView view, std::size_t pixels) {
    const cuda::DeviceBuffer<glm::vec4> film(pixels);
    const auto launch = cuda::chooseLaunch<kernel::Analog<kernel::Superposed>>(scene);
    EXPECT_EQ(launch({view, sampleNumber(scene.sampling, 0), film.data(), nullptr}), cudaSuccess);
    return cudaDeviceSynchronize() == cudaSuccess ? "" : substitute::lastFault();
  };
  const cuda::DeviceScene uploaded(plan.view());
  EXPECT_EQ(faultOf(uploaded.view(), 64), "");
  EXPECT_THAT(faultOf(uploaded.view(), 63), testing::HasSubstr("store outside of memory"));
  EXPECT_THAT(faultOf(plan.view(), 64), testing::HasSubstr("load outside of memory"));  // the host's pointers
}

}  // namespace
}  // namespace scolopax
