// SPDX-License-Identifier: Apache-2.0
// Depth, channel, transmittance and cost against closed forms and counts, for every method.
#include "renderer/data/aov.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "renderer/renderer.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

std::unique_ptr<Renderer> rendered(const std::shared_ptr<const Volume>& volume, const Scene& scene,
                                   int samples, bool record = true) {
  auto renderer = makeCpuRenderer(volume, 2);
  if (record) renderer->recordAovs();
  renderer->setScene(scene);
  for (int i = 0; i < samples; ++i) renderer->renderSample(kNever);
  return renderer;
}

/// 8^3 voxels: channel 0 in the front half, channel 1 in the back half.
struct Halves {
  std::shared_ptr<const Volume> volume;
  Scene scene;
  explicit Halves(double frontDensity, double backDensity) {
    const glm::ivec3 dims(8, 8, 8);
    volume = volumeOf(gridOf(dims, glm::dvec3(0.5)),
                      channelOf<std::uint8_t>(dims, [](int, int, int z) { return z < 4 ? 1 : 0; }),
                      channelOf<std::uint8_t>(dims, [](int, int, int z) { return z < 4 ? 0 : 1; }));
    scene = frontScene(*volume, 6, 6);
    scene.step = 0.02;  // of the marcher: its bias is below the tolerances
    for (std::size_t i = 0; i < 2; ++i) {
      // A step: opacity 1 from half way between the two layers of voxels on.
      scene.channels[i].rangeLo = scene.channels[i].rangeHi = 0.5;
      scene.channels[i].density = i == 0 ? frontDensity : backDensity;
    }
  }
};

TEST(Aovs, OfAnOpaqueFrontAreItsFaceAndItsChannel) {
  for (const Method method : kAllMethods)
    for (const BlendMode blend : kBlends) {
      Halves halves(1e4, 1e4);
      halves.scene.method = method;
      halves.scene.blend = blend;
      const auto renderer = rendered(halves.volume, halves.scene, 4);
      const auto depth = renderer->aov(Aov::depth), channel = renderer->aov(Aov::channel);
      ASSERT_EQ(depth.values.size(), 36u);
      // The eye is one box diagonal from the centre; the face is nearer by half of the edge, 4.
      const double face = halves.volume->grid().diagonal() - 2;
      for (std::size_t i = 0; i < 36; ++i) {
        EXPECT_NEAR(depth.values[i], face, 0.011) << nameOf(method) << " " << nameOf(blend);
        EXPECT_EQ(channel.values[i], 0) << nameOf(method) << " " << nameOf(blend);
        EXPECT_NEAR(renderer->aov(Aov::transmittance).values[i], 0, 1e-4);
      }
    }
}

TEST(Aovs, OfAnOpaqueFrontAreItsFaceAtAnyStep) {
  for (const BlendMode blend : kBlends)
    for (const double step : {0.0, 0.5, 3.0}) {
      Halves halves(1e4, 1e4);
      halves.scene.method = Method::raymarch;
      halves.scene.blend = blend;
      halves.scene.step = step;
      const auto renderer = rendered(halves.volume, halves.scene, 4);
      // Half of all light is absorbed in front of 0.7e-4.
      for (const float depth : renderer->aov(Aov::depth).values)
        EXPECT_NEAR(depth, halves.volume->grid().diagonal() - 2, 1e-3) << nameOf(blend) << " step " << step;
    }
}

TEST(Aovs, OfTheChannelAreWithoutWeights) {
  // In mix, weights are of colours only: a ray collides with the channel of the largest extinction.
  const auto volume =
      volumeOf(gridOf(glm::ivec3(4)), channelOf<std::uint8_t>(glm::ivec3(4), [](int, int, int) { return 1; }),
               channelOf<std::uint8_t>(glm::ivec3(4), [](int, int, int) { return 1; }));
  Scene scene = frontScene(*volume, 4, 4);
  scene.blend = BlendMode::mix;
  for (const auto& [front, back, expected] : {std::tuple{1.0, 0.5, 0}, {0.5, 1.0, 1}, {0.0, 1.0, 1}}) {
    scene.channels[0] = solid(front);
    scene.channels[1] = solid(back);
    if (front == 0) scene.channels[0].opacity = {{0, 0}};
    scene.channels[std::size_t(expected)].weight = front == 0 ? 0 : 0.1;
    scene.channels[std::size_t(1 - expected)].weight = 5;
    for (const Method method : kAllMethods) {
      scene.method = method;
      for (const double step : {0.0, 0.7}) {
        scene.step = hasStep(method) ? step : 1;
        const auto renderer = rendered(volume, scene, 8);
        for (const float channel : renderer->aov(Aov::channel).values)
          EXPECT_TRUE(channel == float(expected) || channel < 0) << nameOf(method) << ' ' << channel;
      }
    }
  }
}

TEST(Aovs, OfAHomogeneousMediumAreTheMeanFreeFlightInIt) {
  // Extinction a over the length l: the mean depth of the rays that collide is 1/a - l / (e^(al) - 1). A
  // depth within l has a standard deviation below l / sqrt(12), and four fifths of 36 x 512 rays collide.
  // Tolerance: 6 sigma, and half a step of the marcher.
  const double a = 0.4, length = 4;
  for (const Method method : kAllMethods) {
    Halves halves(a, a);
    halves.scene.method = method;
    const auto renderer = rendered(halves.volume, halves.scene, 512);
    const auto depth = renderer->aov(Aov::depth), transmittance = renderer->aov(Aov::transmittance);
    double sum = 0, through = 0;
    for (std::size_t i = 0; i < 36; ++i) {
      sum += double(depth.values[i]) / 36;
      through += double(transmittance.values[i]) / 36;
    }
    const double front = halves.volume->grid().diagonal() - length / 2;
    const double expected = 1 / a - length / std::expm1(a * length);
    EXPECT_NEAR(sum - front, expected, 6 * 1.155 / std::sqrt(0.8 * 36 * 512) + 0.01) << nameOf(method);
    EXPECT_NEAR(through, std::exp(-a * length), 6 * std::sqrt(0.2 * 0.8 / (36 * 512))) << nameOf(method);
  }
}

TEST(Aovs, NameTheChannelInWhichMostRaysEnd) {
  // 1 - e^-0.4 = 0.33 of the rays end in front, and nearly all of the others behind: 0.67.
  for (const Method method : kAllMethods) {
    Halves halves(0.2, 1e3);
    halves.scene.method = method;
    for (const float channel : rendered(halves.volume, halves.scene, 512)->aov(Aov::channel).values)
      EXPECT_EQ(channel, 1) << nameOf(method);
    // The index is that in the volume, even if the channel before it is not in the plan.
    halves.scene.channels[0].visible = false;
    for (const float channel : rendered(halves.volume, halves.scene, 4)->aov(Aov::channel).values)
      EXPECT_EQ(channel, 1) << nameOf(method);
  }
}

TEST(Aovs, OfDepthAreDistancesAlongTheViewDirectionInPerspective) {
  // An opaque plane across the view has one depth, whatever the angle of the ray.
  for (const double distance : {3.0, 1e5}) {
    Halves halves(1e4, 1e4);
    halves.scene.camera.orthoHeight.reset();
    halves.scene.camera.eye = halves.scene.camera.target - glm::dvec3(0, 0, 2 + distance);
    halves.scene.camera.fovY = 2 * std::atan(1.9 / distance) * 180 / 3.14159265358979;
    for (const float depth : rendered(halves.volume, halves.scene, 4)->aov(Aov::depth).values)
      EXPECT_NEAR(depth, distance, 0.011 + distance * 1e-6);
  }
}

TEST(Aovs, AreNotDefinedWhereNothingIsMet) {
  for (const Method method : kAllMethods) {
    Halves halves(0, 0);
    halves.scene.method = method;
    const auto renderer = rendered(halves.volume, halves.scene, 4);
    for (const float v : renderer->aov(Aov::depth).values) EXPECT_TRUE(std::isnan(v));
    for (const float v : renderer->aov(Aov::channel).values) EXPECT_TRUE(std::isnan(v));
    for (const float v : renderer->aov(Aov::transmittance).values) EXPECT_EQ(v, 1);
    for (const float v : renderer->aov(Aov::cost).values) EXPECT_EQ(v, 0);
    EXPECT_EQ(aovImage(renderer->aov(Aov::depth)).pixels[0], glm::vec4(0));
  }
}

TEST(Aovs, OfCostAddUpToTheFetchesCounted) {
  for (const Method method : kAllMethods) {
    Halves halves(0.4, 0.8);
    halves.scene.method = method;
    halves.scene.shading = halves.scene.shadows = true;
    halves.scene.step = 0.5;
    const auto renderer = rendered(halves.volume, halves.scene, 8);
    double sum = 0;
    for (const float v : renderer->aov(Aov::cost).values) sum += 8.0 * double(v);
    EXPECT_NEAR(sum, double(renderer->stats().fetches), 1e-3 * sum);
    EXPECT_GT(sum, 0);
  }
}

TEST(Aovs, DoNotChangeThePicture) {
  for (const Method method : kAllMethods)
    for (const BlendMode blend : kBlends) {
      Halves halves(0.4, 0.8);
      halves.scene.method = method;
      halves.scene.blend = blend;
      halves.scene.shadows = true;
      halves.scene.step = 0.5;
      const Image with = rendered(halves.volume, halves.scene, 8)->image();
      const Image without = rendered(halves.volume, halves.scene, 8, false)->image();
      EXPECT_EQ(std::memcmp(with.pixels.data(), without.pixels.data(), 36 * sizeof(glm::vec4)), 0)
          << nameOf(method) << " " << nameOf(blend);
    }
}

TEST(Aovs, BeginAnewWithTheFilm) {
  Halves halves(1e4, 1e4);
  auto renderer = rendered(halves.volume, halves.scene, 4, false);
  for (const float v : renderer->aov(Aov::depth).values) EXPECT_TRUE(std::isnan(v));
  renderer->recordAovs();
  EXPECT_EQ(renderer->samples(), 0u);
  renderer->renderSample(kNever);
  for (const float v : renderer->aov(Aov::channel).values) EXPECT_EQ(v, 0);
  // Another scene: nothing of the first may remain.
  halves.scene.channels[0].visible = false;
  renderer->setScene(halves.scene);
  for (const float v : renderer->aov(Aov::channel).values) EXPECT_TRUE(std::isnan(v));
  renderer->renderSample(kNever);
  for (const float v : renderer->aov(Aov::channel).values) EXPECT_EQ(v, 1);
  EXPECT_EQ(renderer->stats().rays, 36u);
}

TEST(AovPictures, ShowNearAsWhiteAndTheLargestCostAsTheBrightest) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Image depth = aovPicture({Aov::depth, 3, 1, {2, 5, nan}});
  EXPECT_EQ(depth.pixels[0], glm::vec4(1));
  EXPECT_GT(depth.pixels[1].r, 0);
  EXPECT_LT(depth.pixels[1].r, 0.1f);
  EXPECT_EQ(depth.pixels[2], glm::vec4(0));
  const Image cost = aovPicture({Aov::cost, 2, 1, {0, 40}});
  EXPECT_LT(cost.pixels[0].g, 0.01f);
  EXPECT_GT(cost.pixels[1].g, 0.9f);
  const Image values = aovImage({Aov::cost, 2, 1, {0, 40}});
  EXPECT_EQ(values.pixels[1], glm::vec4(40, 40, 40, 1));
}

}  // namespace
}  // namespace scolopax
