// SPDX-License-Identifier: Apache-2.0
// Surfaces and matter together: every tracker against the reference, in all blend modes and lights.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "renderer/kernel/trackers/one_process.h"
#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/agreement.h"

namespace scolopax {
namespace {

using namespace test;

/// Two channels with matter and surfaces, seen from outside.
Scene mixedScene(const Volume& volume, double density) {
  Scene scene = viewFrom(volume, {-9, -12, -20}, {5, 5, 5}, 38, 12);
  scene.filter = PixelFilter::point;
  scene.channels = {ramp(0, 1, density, kRed), ramp(0, 1, 0.5 * density, kBlue)};
  scene.channels[0].isovalues = {{0.62, 0.4, kGreen}, {0.3, 0.2, {}}};
  scene.channels[1].opacity = {{0, 0}, {0.4, 0.1}, {0.55, 0.8}, {0.7, 0.2}, {1, 0.4}};
  scene.channels[1].peaks = Peaks::both;
  scene.channels[1].weight = 0.7;
  return scene;
}

std::shared_ptr<const Volume> mixedVolume() {
  const glm::ivec3 dims(12, 11, 10);
  return volumeOf(gridOf(dims, {1, 0.8, 1.3}), channelOf<float>(dims, lumps(0)),
                  channelOf<std::uint8_t>(
                      dims, [](int x, int y, int z) { return 255 * lumps(2)(x, y, z); }, 1.0 / 255));
}

/// Quadrature, which meets the same surfaces; its bias is that of matter and of shadows.
void expectMarchedNearReference(const std::shared_ptr<const Volume>& volume, Scene scene, double tolerance) {
  const auto expected = reference::renderReference(*volume, scene, 1);
  for (const Method method : {Method::raymarch, Method::hybrid}) {
    scene.method = method;
    scene.step = 0.05;
    const Image found = renderSamples(volume, scene, method == Method::hybrid ? 512 : 128);
    double squares = 0;
    for (std::size_t i = 0; i < found.pixels.size(); ++i)
      for (int c = 0; c < 4; ++c) {
        const double off = double(found.pixels[i][c]) - double(expected.image.pixels[i][c]);
        squares += off * off / double(4 * found.pixels.size());
      }
    EXPECT_LT(std::sqrt(squares), tolerance) << nameOf(method);
  }
}

class SurfacesIn : public testing::TestWithParam<int> {};

TEST_P(SurfacesIn, MatterOfEveryBlendModeMatchTheReference) {
  const auto volume = mixedVolume();
  for (const double density : {0.1, 3.0}) {
    SCOPED_TRACE(density);
    Scene scene = mixedScene(*volume, density);
    scene.blend = kBlends[GetParam()];
    expectUnbiased(volume, scene);
    expectMarchedNearReference(volume, scene, 1e-3);
  }
}

TEST_P(SurfacesIn, LightOfEveryKindMatchTheReference) {
  const auto volume = mixedVolume();
  for (const auto& [shading, shadows] : {std::pair{true, false}, {false, true}, {true, true}}) {
    SCOPED_TRACE(testing::Message() << "shading " << shading << ", shadows " << shadows);
    Scene scene = mixedScene(*volume, 0.3);
    scene.blend = kBlends[GetParam()];
    scene.shading = shading;
    scene.shadows = shadows;
    scene.lights = {{LightType::directional, {1, 0.4, 0.7}, kWhite, 0.8},
                    {LightType::point, {5, 4, 6}, {1, 0.7, 0.4}, 0.5}};
    expectUnbiased(volume, scene);
    expectMarchedNearReference(volume, scene, 3e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(, SurfacesIn, testing::Range(0, 4),
                         [](const auto& blend) { return std::string(nameOf(kBlends[blend.param])); });

TEST(SurfacesInMatter, OfClippedChannelsMatchTheReference) {
  const auto volume = mixedVolume();
  Scene scene = mixedScene(*volume, 0.4);
  scene.clip = {{{5, 5, 5}, {1, 0.3, -0.4}, std::vector<int>{0}},
                {{5, 4, 6}, {-0.2, 1, 0.1}, std::vector<int>{1}}};
  scene.shadows = true;
  expectUnbiased(volume, scene);
}

/// Defects, each of which the comparison with the reference must detect.
class SurfaceDefect : public testing::Test {
 protected:
  SurfaceDefect() : volume_(mixedVolume()), scene_(mixedScene(*volume_, 0.3)) {
    scene_.shading = scene_.shadows = true;
    expected_ = reference::renderReference(*volume_, scene_, 1);
  }
  /// Compares the scene rendered with changed surfaces of every channel.
  ::testing::AssertionResult passes(const std::function<void(std::vector<kernel::SurfaceView>&)>& change) {
    std::vector<kernel::ChannelView> channels;
    std::vector<std::vector<kernel::SurfaceView>> surfaces;
    const auto found = replicateKernel<kernel::Analog<kernel::Superposed>, kernel::BlendDensity, kernel::Lit>(
        volume_, scene_, [&](kernel::SceneView& view) {
          channels.assign(view.channels, view.channels + view.channelCount);
          surfaces.clear();
          for (kernel::ChannelView& channel : channels) {
            change(surfaces.emplace_back(channel.surfaces, channel.surfaces + channel.surfaceCount));
            channel.surfaces = surfaces.back().data();
            channel.surfaceCount = int(surfaces.back().size());
          }
          view.channels = channels.data();
        });
    return haveMean(found, scene_, expected_);
  }
  std::shared_ptr<const Volume> volume_;
  Scene scene_;
  reference::ReferenceImage expected_;
};

TEST_F(SurfaceDefect, NoneIsFoundWhereThereIsNone) {
  EXPECT_TRUE(passes([](auto&) {}));
}

TEST_F(SurfaceDefect, OfOpacityColourPlaceAndNumberIsFound) {
  if (statisticsFactor() < 1) GTEST_SKIP() << "needs its samples";
  const auto changes = [&](auto&& change) {
    return passes([&](auto& surfaces) {
      for (kernel::SurfaceView& surface : surfaces) change(surface);
    });
  };
  EXPECT_FALSE(changes([](kernel::SurfaceView& s) { s.opacity *= 0.9f; }));
  EXPECT_FALSE(changes([](kernel::SurfaceView& s) { s.color *= 0.9f; }));
  EXPECT_FALSE(changes([](kernel::SurfaceView& s) { s.value *= 1.03f; }));
  EXPECT_FALSE(passes([](auto& surfaces) { surfaces.pop_back(); }));
  EXPECT_FALSE(passes([](auto& surfaces) { surfaces.push_back(surfaces[0]); }));
}

}  // namespace
}  // namespace scolopax
