// SPDX-License-Identifier: Apache-2.0
// The device path draws what the CPU backend draws, bit for bit, in every instance of the kernels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "renderer/renderer.h"
#include "tests/cuda/device_scenes.h"

namespace scolopax {
namespace {

using namespace test;

const std::atomic<bool> kNever = false;

std::size_t differentPixels(const Image& a, const Image& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    count += std::memcmp(&a.pixels[i], &b.pixels[i], sizeof a.pixels[i]) != 0;
  return count;
}

/// Fraction of the pixels that show anything.
double coverage(const Image& image) {
  const auto shown = std::count_if(image.pixels.begin(), image.pixels.end(),
                                   [](const glm::vec4& pixel) { return pixel.a > 0; });
  return double(shown) / double(image.pixels.size());
}

/// Whether a device's counts of fetches and cells are those of the CPU.
enum class Counts { equal, fewer, atMost };

/// Renders on both, compares pictures and counts.
void expectSameOnBoth(const std::shared_ptr<const Volume>& volume, const Scene& scene, int samples,
                      Counts counts = Counts::equal) {
  const auto cpu = makeCpuRenderer(volume, 1);
  cpu->countCosts();
  cpu->setScene(scene);
  for (int i = 0; i < samples; ++i) ASSERT_TRUE(cpu->renderSample(kNever));
  const Image expected = cpu->image();
  const PictureAndCost found = renderOnDevice(volume, scene, std::uint32_t(samples));
  ASSERT_EQ(found.image.pixels.size(), expected.pixels.size());
  EXPECT_EQ(differentPixels(found.image, expected), 0u);
  EXPECT_GT(coverage(expected), 0.1);

  const RenderStats stats = cpu->stats();
  RenderStats counted;
  for (const kernel::SampleCost& cost : found.cost) {
    counted.fetches += cost.fetches;
    counted.cellSteps += cost.cellSteps;
    counted.randomBlocks += cost.randomBlocks;
    counted.truncatedRays += cost.truncated;
  }
  // The CPU takes several rays or points at once, and so looks at some that do not show.
  if (scene.method == Method::raymarch || scene.method == Method::hybrid) counts = Counts::atMost;
#if defined(SCOLOPAX_HOST_KERNELS)
  if (counts == Counts::fewer) counts = Counts::equal;
#endif
  if (counts == Counts::fewer) {
    EXPECT_LT(counted.fetches, stats.fetches);
  }
  if (counts != Counts::equal) {
    EXPECT_LE(counted.fetches, stats.fetches);
    EXPECT_LE(counted.cellSteps, stats.cellSteps);
  } else {
    EXPECT_EQ(counted.fetches, stats.fetches);
    EXPECT_EQ(counted.cellSteps, stats.cellSteps);
  }
  EXPECT_EQ(counted.randomBlocks, stats.randomBlocks);
  EXPECT_EQ(counted.truncatedRays, stats.truncatedRays);
  EXPECT_GT(stats.fetches, 0u);
}

/// The substitute runtime always has a device; linked with CUDA's own, there may be none.
class DevicePicture : public testing::Test {
 protected:
  void SetUp() override {
    if (cuda::deviceCount() == 0) GTEST_SKIP() << "no CUDA device";
  }
};
class DevicePictures : public DevicePicture, public testing::WithParamInterface<Method> {};

/// Calls f(scene) with scenes of every instance of an integrator's kernels.
template <class F>
void forEveryBlendModeAndLight(Scene scene, Method method, F&& f) {
  scene.method = method;
  for (const BlendMode blend : {BlendMode::density, BlendMode::max, BlendMode::mix, BlendMode::composite})
    for (const bool shading : {false, true})
      for (const bool shadows : {false, true}) {
        SCOPED_TRACE(std::string(nameOf(blend)) + (shading ? ", shading" : "") +
                     (shadows ? ", shadows" : ""));
        scene.blend = blend;
        scene.shading = shading;
        scene.shadows = shadows;
        f(scene);
      }
}

// Sizes that fill the last blocks of threads and sizes that do not.
TEST_P(DevicePictures, AreThoseOfTheCpuInEveryBlendModeAndLight) {
  const auto mixed = mixedVolume(), withSign = signedVolume();
  forEveryBlendModeAndLight(obliqueScene(*mixed, 24, 24), GetParam(),
                            [&](const Scene& scene) { expectSameOnBoth(mixed, scene, 3); });
  Scene scene = obliqueScene(*withSign, 19, 13);
  scene.filter = PixelFilter::point;
  scene.sampling = Sampling::independent;
  forEveryBlendModeAndLight(scene, GetParam(),
                            [&](const Scene& each) { expectSameOnBoth(withSign, each, 2); });
}

// Of integers, of voxels that are not finite, and beside a channel without.
TEST_P(DevicePictures, WithOpacityByTheGradientAreThoseOfTheCpuInEveryBlendModeAndLight) {
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 17, 14);
  for (const std::size_t n : {1, 2}) {
    const Histogram& histogram = volume->channels()[n].histogram;
    GradientOpacity factor;
    factor.rangeLo = 0;
    factor.rangeHi = 0.3 * (histogram.maximum - histogram.minimum);
    factor.factor = {{0, 0.1}, {0.3, 1}, {0.6, 0.2}, {1, 0.8}};
    scene.channels[n].gradientOpacity = factor;
  }
  forEveryBlendModeAndLight(scene, GetParam(), [&](const Scene& each) { expectSameOnBoth(volume, each, 2); });
  for (ChannelAppearance& channel : scene.channels) channel.density = 1e5;
  scene.method = GetParam();
  expectSameOnBoth(volume, scene, 2, Counts::fewer);
}

// Trackers look closer at such cells; the CPU's, for which that is a loop of its own, track such rays twice.
TEST_P(DevicePictures, OfThickCellsAreThoseOfTheCpu) {
  const auto volume = mixedVolume();
  for (const BlendMode blend : {BlendMode::density, BlendMode::max, BlendMode::composite}) {
    SCOPED_TRACE(nameOf(blend));
    Scene scene = obliqueScene(*volume, 16, 12);
    scene.method = GetParam();
    scene.blend = blend;
    for (ChannelAppearance& channel : scene.channels) {
      channel.density = 1e5;
      channel.opacity = {{0, 0}, {0.3, 0}, {1, 1}};
    }
    expectSameOnBoth(volume, scene, 2, Counts::fewer);
  }
}

INSTANTIATE_TEST_SUITE_P(Of, DevicePictures,
                         testing::Values(Method::superposed, Method::cumulative, Method::syncDda,
                                         Method::nDda, Method::raymarch, Method::hybrid),
                         [](const auto& instance) {
                           std::string name(nameOf(instance.param));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_F(DevicePicture, OfOnePixelAndOfThinStripsIsThatOfTheCpu) {
  const auto volume = mixedVolume();
  for (const glm::ivec2 size : {glm::ivec2(1, 1), glm::ivec2(40, 1), glm::ivec2(1, 40), glm::ivec2(9, 17)}) {
    Scene scene = obliqueScene(*volume, size.x, size.y);
    scene.camera.eye = scene.camera.target + 0.1 * (scene.camera.eye - scene.camera.target);  // inside
    expectSameOnBoth(volume, scene, 4);
  }
}

TEST_F(DevicePicture, OfASceneWithoutVisibleChannelsIsTransparent) {
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 8, 8);
  for (ChannelAppearance& channel : scene.channels) channel.visible = false;
  const PictureAndCost picture = renderOnDevice(volume, scene, 1);
  EXPECT_EQ(coverage(picture.image), 0);
}

}  // namespace
}  // namespace scolopax
