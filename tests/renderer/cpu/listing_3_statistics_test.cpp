// SPDX-License-Identifier: Apache-2.0
// The paper prints Listing 3 with its two tests in an order that loses collisions. Total energy hides it;
// colour per pixel does not: these tests would not tell a mended n-dda from a printed one unless the last one
// failed.
#include <gtest/gtest.h>

#include "renderer/data/render_plan.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/render_pixel.h"
#include "tests/support/statistics.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

/// Listing 3 as printed: a step beyond the nearest collision so far ends the traversal, although it may also
/// lie beyond the end of a thin cell with a denser one behind.
struct PrintedNDda {
  template <class Blend>
  static std::optional<kernel::Collision> track(const kernel::SceneView& scene, const kernel::Ray& ray,
                                                kernel::Interval inside, kernel::Sampler& sampler,
                                                kernel::SampleCost* cost) {
    std::optional<kernel::Collision> nearest;
    for (int n = 0; n < scene.channelCount; ++n)
      trackPrinted<Blend>(scene, n, ray, inside, sampler, &nearest, cost);
    return nearest;
  }

 private:
  template <class Blend>
  static void trackPrinted(const kernel::SceneView& scene, int n, const kernel::Ray& ray,
                           kernel::Interval inside, kernel::Sampler& sampler,
                           std::optional<kernel::Collision>* nearest, kernel::SampleCost* cost) {
    kernel::CellWalk walk(ray, inside, scene.majorants);
    do {
      const float bound =
          scene.majorants.values[walk.index() * std::size_t(1 + scene.channelCount) + std::size_t(1 + n)];
      if (!(bound > 0)) continue;
      float t = walk.enter();
      while (true) {
        const kernel::RandomBlock random = sampler.next();
        t += kernel::opticalDepth(kernel::uniformOf(random.x)) / bound;
        if (*nearest && t > (*nearest)->place.t()) return;  // the order that is printed
        if (!(t < walk.exit())) break;
        const kernel::Place place{t, 0};
        if (const auto hit =
                kernel::testChannel<Blend>(scene, n, bound, place, walk.pointAt(t), random, cost)) {
          *nearest = hit;
          return;
        }
      }
    } while (walk.advance());
  }
};

template <class Tracker>
Image render(const std::shared_ptr<const Volume>& volume, const Scene& scene, int samples) {
  samples *= statisticsFactor();
  RenderPlan plan(volume);
  plan.update(scene);
  Image sum{scene.width, scene.height, std::vector<glm::vec4>(std::size_t(scene.width * scene.height))};
  std::vector<glm::vec4> pass(sum.pixels.size());
  for (int s = 0; s < samples; ++s) {
    const kernel::RenderPixel<kernel::Analog<Tracker>, kernel::BlendDensity,
                              kernel::LightFeatures<false, false>>
        pixel{plan.view(), {std::uint32_t(s), false, {}}, pass.data(), nullptr};
    for (int i = 0; i < int(pass.size()); ++i) {
      pixel(i);
      sum.pixels[std::size_t(i)] += pass[std::size_t(i)] / float(samples);
    }
  }
  return sum;
}

TEST(Listing3, LosesCollisionsAsPrintedAndNoneAsMended) {
  // Channels that alternate between thin and dense along the ray, out of step with each other.
  const glm::ivec3 dims(16, 16, 32);
  const auto layers = [](int phase) {
    return [phase](int, int, int z) { return (z / 4 + phase) % 2 ? 255 : 4; };
  };
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, layers(0)),
               channelOf<std::uint8_t>(dims, layers(1)), channelOf<std::uint8_t>(dims, layers(0)));
  Scene scene = frontScene(*volume, 24, 24);
  for (int i = 0; i < 3; ++i) {
    ChannelAppearance& a = scene.channels[std::size_t(i)];
    a.rangeHi = 255;
    a.density = 0.1;
    a.color = {{0, glm::dvec3(i == 0, i == 1, i == 2)}};
  }
  const auto expected = reference::renderReference(*volume, scene, 1);
  EXPECT_TRUE(isUnbiased(render<kernel::NDda>(volume, scene, 300), 300, expected));
  EXPECT_FALSE(isUnbiased(render<PrintedNDda>(volume, scene, 300), 300, expected));
}

}  // namespace
}  // namespace scolopax
