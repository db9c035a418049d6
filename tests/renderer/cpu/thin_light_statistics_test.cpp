// SPDX-License-Identifier: Apache-2.0
// Light in thin media, where a stratum of absorbed light extends far along the ray: its lit and shadowed
// parts must each be lit at their own place. Every method, in every blend mode and light.
#include <gtest/gtest.h>

#include <algorithm>

#include "renderer/kernel/raymarch.h"
#include "renderer/kernel/trackers/one_process.h"
#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

ChannelAppearance slab(glm::dvec3 color, double density) {
  ChannelAppearance a;
  a.rangeLo = 0;
  a.rangeHi = 1;
  a.opacity = {{0, 0}, {1, 1}};
  a.color = {{0, color}};
  a.density = density;
  a.material = {0.3, 0.9, 0, 8};
  return a;
}

/// Two thin slabs of 5 voxels, one behind the other: red in the light, and green in the shadow of a wall
/// beside the rays.
VolumeAndScene litAndShadowed(double density) {
  const glm::ivec3 dims(12, 6, 20);
  const auto between = [](int lo, int hi) {
    return [=](int x, int, int z) { return x >= 4 && z >= lo && z < hi; };
  };
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, between(3, 8)),
               channelOf<std::uint8_t>(dims, between(12, 17)),
               channelOf<std::uint8_t>(dims, [](int x, int, int z) { return x < 2 && z >= 10; }));
  Scene scene;
  scene.width = scene.height = 3;
  scene.filter = PixelFilter::point;
  scene.camera.eye = {8, 2.5, -20};
  scene.camera.target = {8, 2.5, 0};
  scene.camera.up = {0, 1, 0};
  scene.camera.orthoHeight = 3;
  scene.lights = {{LightType::directional, {1, 0, 0}, glm::dvec3(1), 1}};
  scene.channels = {slab(kRed, density), slab(kGreen, density), slab(kBlue, 1e4)};
  scene.macrocell = 2;
  return {volume, scene};
}

/// One channel whose gradient rotates along the ray: values rise towards the middle of x where z is small,
/// and towards its ends where z is large. The light is inside.
VolumeAndScene turningNormal(double density) {
  const glm::ivec3 dims(9, 7, 16);
  const auto value = [](int x, int, int z) {
    const double way = std::abs(x - 1.0);
    return z < 8 ? 10 * way : 100 - 10 * way;
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, value));
  Scene scene;
  scene.width = scene.height = 3;
  scene.filter = PixelFilter::point;
  scene.camera.eye = {5, 3, -30};
  scene.camera.target = {5, 3, 0};
  scene.camera.up = {0, 1, 0};
  scene.camera.orthoHeight = 3;
  scene.lights = {{LightType::point, {8.3, 5, 4}, {1, 0.8, 0.6}, 1}};
  scene.channels = {slab(glm::dvec3(1), density)};
  scene.channels[0].rangeHi = 100;
  scene.channels[0].color = {{0, kRed}, {0.4, kGreen}, {1, kBlue}};
  return {volume, scene};
}

/// Bound on the bias of quadrature at a step of 1/8 spacing, relative to the brightest component of the
/// picture. The bias is of order 2 in the step.
constexpr double kBias = 5e-3;

/// A defect: a collision is shaded at one place, but the light that reaches it is computed at another.
struct LitAtPlacesApart {
  template <class Blend, class Lighting>
  static glm::vec4 sample(const kernel::SceneView& scene, const kernel::Ray& ray, kernel::Interval inside,
                          kernel::Sampler& sampler, kernel::SampleCost* cost, kernel::FirstCollision*) {
    const auto track = [&](const kernel::Ray& way, kernel::Interval part) {
      return kernel::Superposed::track<Blend>(scene, way, part, sampler, cost);
    };
    const auto hit = track(ray, inside);
    if (!hit) return glm::vec4(0);
    auto other = track(ray, inside);
    while (!other) other = track(ray, inside);
    const auto place = [&](const kernel::Collision& of) {
      return kernel::LitPoint<kernel::One>{ray, of.distance.t(), of.point};
    };
    const auto visibility = kernel::visibilityAt(
        scene, place(*other), true,
        [&](const kernel::Ray& way, kernel::Interval part) { return track(way, part) ? 0.0f : 1.0f; });
    const kernel::ChannelView& channel = scene.channels[hit->channel];
    return glm::vec4(kernel::lit(scene, channel, kernel::evaluate(channel.color, hit->position), place(*hit),
                                 visibility, true, false, cost),
                     1);
  }
};

/// A defect of quadrature: a stratum is shaded at one place, but the light that reaches it is computed in the
/// other slab of litAndShadowed().
struct ShadowedElsewhere : kernel::EqualSteps {
  struct Moved {
    kernel::Ray own;
  };
  /// The segments of shadow rays.
  template <class L, class View>
  struct WholeCuts : private Moved, public kernel::CellSegments<View> {
    WholeCuts(kernel::SegmentEnds<L, View>& ends, const View& scene, const kernel::Ray& ray,
              const kernel::Interval& inside, std::uint32_t channels, float offset, float step,
              kernel::SampleCost* cost)
        : Moved{ray},
          kernel::CellSegments<View>(ends, scene, moved(), inside, channels, offset, step, cost) {}

   private:
    const kernel::Ray& moved() {
      own.origin.z = 19 - own.origin.z;
      return own;
    }
  };
};

/// Chosen so that some 300 of all rays of a comparison collide in matter of this optical depth. A tracker's
/// mean picture is then known within some 6 %.
int longerFor(double depth) {
  const double rays = 9.0 * kReplicates * samplesPerReplicate();
  return std::max(1, int(300 / (rays * depth)));
}

class ThinLight : public testing::TestWithParam<BlendMode> {
 protected:
  /// Trackers use `longer` times as many samples as in other tests.
  static void compare(const VolumeAndScene& made, int longer) {
    for (const LightConfiguration& light : kLightConfigurations) {
      Scene scene = made.scene;
      scene.blend = GetParam();
      scene.shading = light.shading;
      scene.shadows = light.shadows;
      const auto expected = reference::renderReference(*made.volume, scene, 1);
      float brightest = 0;
      for (const glm::vec4& pixel : expected.image.pixels)
        brightest = std::max({brightest, pixel.r, pixel.g, pixel.b, pixel.a});
      for (const Method method : kTrackers)
        EXPECT_TRUE(haveMean(replicate(made.volume, scene, method, longer), scene, expected))
            << nameOf(method) << ' ' << light.name;
      auto withBias = expected;
      withBias.maximumRayError += kBias * double(brightest);
      scene.step = 0.125;
      for (const Method method : {Method::raymarch, Method::hybrid})
        EXPECT_TRUE(haveMean(replicate(made.volume, scene, method), scene, withBias))
            << nameOf(method) << ' ' << light.name;
    }
  }
};

TEST_P(ThinLight, FallsOnMatterInLightAndLeavesOutMatterInShadow) {
  for (const double density : {2e-4, 0.001, 0.06}) {
    SCOPED_TRACE(density);
    compare(litAndShadowed(density), longerFor(5 * density));
  }
}

TEST_P(ThinLight, FollowsANormalThatTurnsAlongTheRay) {
  for (const double density : {1e-4, 0.002, 0.03}) {
    SCOPED_TRACE(density);
    compare(turningNormal(density), longerFor(5 * density));
  }
}

TEST(ThinLightDefect, OfVisibilityAndShadingAtDifferentPlacesIsFound) {
  for (const double density : {0.002, 0.06}) {
    const VolumeAndScene made = litAndShadowed(density);
    Scene scene = made.scene;
    scene.shadows = true;
    const auto expected = reference::renderReference(*made.volume, scene, 1);
    const auto unspoilt = [](kernel::SceneView&) {};
    EXPECT_TRUE(
        haveMean(replicateKernel<kernel::Analog<kernel::Superposed>, kernel::BlendDensity, kernel::Lit>(
                     made.volume, scene, unspoilt),
                 scene, expected));
    EXPECT_FALSE(haveMean(
        replicateKernel<LitAtPlacesApart, kernel::BlendDensity, kernel::Lit>(made.volume, scene, unspoilt),
        scene, expected));
  }
}

TEST(ThinLightDefect, OfStrataLitInTheOtherSlabIsFound) {
  for (const double density : {0.001, 0.06}) {
    const VolumeAndScene made = litAndShadowed(density);
    Scene scene = made.scene;
    scene.shadows = true;
    scene.method = Method::raymarch;
    scene.step = 0.125;
    auto expected = reference::renderReference(*made.volume, scene, 1);
    float brightest = 0;
    for (const glm::vec4& pixel : expected.image.pixels) brightest = std::max({brightest, pixel.r, pixel.a});
    expected.maximumRayError += kBias * double(brightest);
    const auto unspoilt = [](kernel::SceneView&) {};
    EXPECT_TRUE(
        haveMean(replicateKernel<kernel::RayMarch<kernel::EqualSteps>, kernel::BlendDensity, kernel::Lit>(
                     made.volume, scene, unspoilt),
                 scene, expected));
    EXPECT_FALSE(
        haveMean(replicateKernel<kernel::RayMarch<ShadowedElsewhere>, kernel::BlendDensity, kernel::Lit>(
                     made.volume, scene, unspoilt),
                 scene, expected));
  }
}

INSTANTIATE_TEST_SUITE_P(BlendModes, ThinLight, testing::ValuesIn(kBlends),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

}  // namespace
}  // namespace scolopax
