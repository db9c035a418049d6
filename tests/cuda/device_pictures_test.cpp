// SPDX-License-Identifier: Apache-2.0
// In every instance of the kernels, the device renders the same picture as the CPU backend, bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "renderer/renderer.h"
#include "tests/cuda/device_scenes.h"

namespace scolopax {
namespace {

using namespace test;

std::size_t differentPixels(const Image& a, const Image& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    count += std::memcmp(&a.pixels[i], &b.pixels[i], sizeof a.pixels[i]) != 0;
  return count;
}

/// Fraction of the pixels that are not empty.
double coverage(const Image& image) {
  const auto shown = std::count_if(image.pixels.begin(), image.pixels.end(),
                                   [](const glm::vec4& pixel) { return pixel.a > 0; });
  return double(shown) / double(image.pixels.size());
}

/// Compares every AOV and a pick in the middle.
void expectSameRecords(const Renderer& cpu, const Renderer& device, const Scene& scene) {
  for (std::size_t a = 0; a < std::size(kAovs); ++a) {
    if (Aov(a) == Aov::cost) continue;  // costs may differ
    const std::vector<float> expected = cpu.aov(Aov(a)).values, found = device.aov(Aov(a)).values;
    ASSERT_EQ(found.size(), expected.size());
    std::size_t different = 0, known = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      different += !(found[i] == expected[i] || (std::isnan(found[i]) && std::isnan(expected[i])));
      known += !std::isnan(expected[i]);
    }
    EXPECT_EQ(different, 0u) << kAovs[a].name;
    EXPECT_GT(known, 0u) << kAovs[a].name;
  }
  const PixelArea area{scene.width / 2, scene.height / 2, 2, 2};
  const auto expected = cpu.pick(scene, area), found = device.pick(scene, area);
  ASSERT_TRUE(expected->run(kNever, Renderer::kNoBudget) && found->run(kNever, Renderer::kNoBudget));
  ASSERT_EQ(found->found().size(), expected->found().size());
  for (std::size_t i = 0; i < found->found().size(); ++i) {
    EXPECT_EQ(found->found()[i].channel, expected->found()[i].channel);
    EXPECT_EQ(found->found()[i].voxel, expected->found()[i].voxel);
  }
}

/// Whether a device counts the same fetches and cells as the CPU.
enum class Counts { equal, fewer, atMost };

/// Renders on both and compares pictures and counts; with `record`, also AOVs and a pick.
void expectSameOnBoth(const std::shared_ptr<const Volume>& volume, const Scene& scene, int samples,
                      Counts counts = Counts::equal, bool record = false) {
  const auto cpu = makeCpuRenderer(volume, 1), device = makeCudaRenderer(volume);
  for (Renderer* renderer : {cpu.get(), device.get()}) {
    renderer->countCosts();
    if (record) renderer->recordAovs();
    renderer->setScene(scene);
    for (int i = 0; i < samples; ++i) ASSERT_TRUE(renderer->renderSample(kNever));
  }
  const Image expected = cpu->image(), found = device->image();
  ASSERT_EQ(found.pixels.size(), expected.pixels.size());
  EXPECT_EQ(differentPixels(found, expected), 0u);
  EXPECT_GT(coverage(expected), 0.1);
  if (record) expectSameRecords(*cpu, *device, scene);

  const RenderStats stats = cpu->stats(), counted = device->stats();
  // The CPU processes several rays or points at once, so it counts some that have no effect.
  if (hasStep(cpu->choice().method)) counts = Counts::atMost;
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

/// The substitute runtime always has a device. Linked with CUDA's own runtime, there may be none.
class DevicePicture : public testing::Test {
 protected:
  void SetUp() override {
    if (cuda::devices().empty()) GTEST_SKIP() << "no CUDA device";
  }
};
class DevicePictures : public DevicePicture, public testing::WithParamInterface<Method> {};

/// Calls f(scene) with a scene for every instance of an integrator's kernels.
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

// Sizes that fill the last blocks of threads, and sizes that do not.
TEST_P(DevicePictures, AreThoseOfTheCpuInEveryBlendModeAndLight) {
  const auto mixed = mixedVolume(), withSign = signedVolume();
  forEveryBlendModeAndLight(obliqueScene(*mixed, 16, 16), GetParam(),
                            [&](const Scene& scene) { expectSameOnBoth(mixed, scene, 2); });
  Scene scene = obliqueScene(*withSign, 13, 11);
  scene.filter = PixelFilter::point;
  scene.sampling = Sampling::independent;
  forEveryBlendModeAndLight(scene, GetParam(),
                            [&](const Scene& each) { expectSameOnBoth(withSign, each, 2); });
}

// In a channel of integers and in one with voxels that are not finite, beside channels without it.
TEST_P(DevicePictures, WithOpacityByTheGradientAreThoseOfTheCpuInEveryBlendModeAndLight) {
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 13, 11);
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

// Trackers use tighter bounds in such cells. On the CPU, which does that in a separate loop, such rays are
// tracked twice.
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

/// A scene with a cubic, a nearest-voxel and a trilinear channel, and surfaces of two of them.
Scene sceneOfEverything(const Volume& volume) {
  Scene scene = obliqueScene(volume, 13, 11);
  scene.channels[0].interpolation = Interpolation::cubic;
  scene.channels[0].isovalues = {{100, 0.5, {}}, {180, 1, glm::dvec3(1, 0, 0)}};
  scene.channels[1].peaks = Peaks::both;
  scene.channels[2].interpolation = Interpolation::nearest;
  const glm::dvec3 centre(volume.grid().worldFromVoxel * glm::dvec4(glm::dvec3(volume.grid().dims) * 0.5, 1));
  scene.clip = {{centre, {1, 0.3, -0.2}, std::vector<int>{0}}, {centre + 2.0, {-1, -1, -0.5}, {}}};
  scene.crop = Crop{{2, 2, 2}, {8, 7, 11}, 0x5a3c96bu | Crop::kInnermost};
  return scene;
}

TEST_P(DevicePictures, WithSurfacesFiltersClipAndCropAreThoseOfTheCpuInEveryBlendModeAndLight) {
  const auto volume = mixedVolume();
  forEveryBlendModeAndLight(sceneOfEverything(*volume), GetParam(), [&](const Scene& each) {
    expectSameOnBoth(volume, each, 2, Counts::atMost, true);
  });
}

TEST_P(DevicePictures, WithRecordsAreThoseOfTheCpu) {
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 13, 11);
  scene.method = GetParam();
  for (const BlendMode blend : {BlendMode::density, BlendMode::mix}) {
    scene.blend = blend;
    expectSameOnBoth(volume, scene, 2, Counts::atMost, true);
  }
}

// Segments between faces of voxel cells.
TEST_P(DevicePictures, AtStepZeroAreThoseOfTheCpuInEveryBlendModeAndLight) {
  if (!hasStep(GetParam())) GTEST_SKIP() << "the method has no step";
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 11, 9);
  scene.step = 0;
  forEveryBlendModeAndLight(scene, GetParam(), [&](const Scene& each) { expectSameOnBoth(volume, each, 2); });
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

// The chosen method may differ from the CPU's, where samples have other costs.
TEST_F(DevicePicture, OfMethodAutoIsThatOfTheMethodAndStepThatItHasChosen) {
  const auto volume = mixedVolume();
  for (const bool shadows : {false, true}) {
    Scene scene = obliqueScene(*volume, 24, 20);
    scene.method = Method::automatic;
    scene.shadows = shadows;
    const auto device = makeCudaRenderer(volume), cpu = makeCpuRenderer(volume, 1);
    device->setScene(scene);
    const Choice choice = device->choice();
    scene.method = choice.method;
    scene.step = choice.step;
    cpu->setScene(scene);
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(device->renderSample(kNever) && cpu->renderSample(kNever));
    ASSERT_TRUE(device->choice().corrections.empty()) << "which the CPU's picture does not have";
    EXPECT_EQ(differentPixels(device->image(), cpu->image()), 0u);
    EXPECT_GT(coverage(cpu->image()), 0.1);
  }
}

TEST_F(DevicePicture, OfASceneWithoutVisibleChannelsIsTransparent) {
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 8, 8);
  for (ChannelAppearance& channel : scene.channels) channel.visible = false;
  const auto device = makeCudaRenderer(volume);
  device->setScene(scene);
  ASSERT_TRUE(device->renderSample(kNever));
  EXPECT_EQ(coverage(device->image()), 0);
}

TEST_F(DevicePicture, DoesNotTakeALongRayWhosePassIsCancelled) {
  // One pixel, whose ray is marched and lit in millions of steps: if it were completed, there would be a
  // sample.
  const glm::ivec3 dims(8, 8, 8192);
  const auto volume = volumeOf(
      gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) { return 1 + (x + y + z) % 7; }));
  Scene scene = frontScene(*volume, 1, 1);
  scene.channels[0].rangeHi = 255;
  scene.channels[0].density = 0.001;
  scene.method = Method::raymarch;
  scene.step = 0.01;
  scene.shadows = true;
  for (int i = 0; i < 8; ++i)
    scene.lights.push_back({LightType::directional, {0.01 * i, 0, 1}, glm::dvec3(1), 1});
  const auto device = makeCudaRenderer(volume);
  device->setScene(scene);
  std::atomic<bool> cancel = false;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    cancel = true;
  });
  EXPECT_FALSE(device->renderSample(cancel));
  canceller.join();
  EXPECT_EQ(device->samples(), 0u);
}

}  // namespace
}  // namespace scolopax
