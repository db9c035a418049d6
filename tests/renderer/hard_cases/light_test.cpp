// SPDX-License-Identifier: Apache-2.0
// Lighting whose value is known exactly: in a linear field of constant opacity every collision has the same
// radiance, so that colour over alpha equals the formula, for every method and at every sample.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "renderer/core/error.h"
#include "tests/renderer/hard_cases/hard_scenes.h"

namespace scolopax {
namespace {

using namespace test;

const glm::dvec3 kColor(0.8, 0.4, 0.2);

/// A slab half of which is in the shadow of a wall, and whose silhouette halves the only pixel.
struct HalfShadow {
  std::shared_ptr<const Volume> volume;
  Scene scene;
  HalfShadow() {
    const glm::ivec3 dims(24, 8, 20);
    volume = volumeOf(gridOf(dims),
                      channelOf<std::uint8_t>(
                          dims, [](int x, int, int z) { return x >= 12 && x < 20 && z >= 5 && z < 15; }),
                      channelOf<std::uint8_t>(dims, [](int x, int, int z) { return x < 2 && z >= 10; }));
    scene = frontScene(*volume, 1, 1);
    scene.camera.orthoHeight = 4;
    scene.channels = {ramp(0, 1, 0.013), ramp(0, 1, 1e4)};
    scene.lights = {{LightType::directional, {1, 0, 0}, glm::dvec3(1), 1}};
    scene.shadows = true;
  }
};

TEST(Light, InAPixelThatIsPartlyCoveredIsThatOfItsWholeArea) {
  // The position in the pixel and the positions that are lit must be independent. Otherwise every seed
  // converges to a picture of its own: some see only the lit half of the slab, and some only the other half.
  if (statisticsFactor() < 1) GTEST_SKIP() << "needs its samples";
  const HalfShadow half;
  const auto expected = reference::renderReference(*half.volume, half.scene, 48);
  const double color = double(expected.image.pixels[0].r), alpha = double(expected.image.pixels[0].a);
  ASSERT_GT(alpha, 0.03);
  ASSERT_LT(alpha, 0.1);
  for (const Method method : {Method::raymarch, Method::hybrid})
    for (std::uint32_t seed = 0; seed < 8; ++seed) {
      Scene scene = half.scene;
      scene.method = method;
      scene.step = 0.125;
      scene.seed = seed;
      const glm::vec4 found = renderSamples(half.volume, scene, 4096).pixels[0];
      EXPECT_NEAR(double(found.a), alpha, 0.005 * alpha) << nameOf(method) << " seed " << seed;
      // Independent samples would have a standard error of 0.7 alpha sqrt(1/8) / 64 = 0.004 alpha.
      EXPECT_NEAR(double(found.r), color, 0.02 * alpha) << nameOf(method) << " seed " << seed;
    }
}

/// A field of value dot(a, voxel) over the range [0, range], seen along +z with parallel rays.
struct LinearField {
  glm::dvec3 a{0, 0, 1};
  double range = 1, offset = 0;
  Grid grid = gridOf({5, 6, 7});
  Material material{0.1, 0.6, 0.35, 7};
  std::vector<Light> lights{{LightType::directional, {0, 0, 1}, glm::dvec3(1), 1}};
  double density = 0.5;
  bool shadows = false;

  template <class T = float>
  void expectRadiance(const glm::dvec3& expected, double tolerance = 1e-5) const {
    const auto volume = volumeOf(grid, channelOf<T>(grid.dims, [&](int x, int y, int z) {
                                   return offset + glm::dot(a, glm::dvec3(x, y, z));
                                 }));
    Scene scene = frontScene(*volume, 12, 12);
    scene.channels[0] = solid(density, kColor);
    scene.channels[0].rangeLo = offset;
    scene.channels[0].rangeHi = offset + range;
    scene.channels[0].material = material;
    scene.lights = lights;
    scene.shading = true;
    scene.shadows = shadows;
    for (const Method method : kAllMethods) {
      const Image image = renderAnalog(volume, scene, method, 4);
      int seen = 0;
      for (const glm::vec4& p : image.pixels) {
        if (!(p.a > 0.1f)) continue;
        ++seen;
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(double(p[c] / p.a), expected[c], tolerance) << nameOf(method) << " component " << c;
      }
      EXPECT_GT(seen, 50) << nameOf(method);
    }
  }
  glm::dvec3 shaded(double s, double nl, double nh) const {
    return kColor * ((1 - s) + s * (material.ambient + material.diffuse * nl)) +
           glm::dvec3(s * material.specular * std::pow(nh, material.shininess));
  }
};

TEST(ExactLight, FadesWithTheGradientAlsoInTheOuterHalfVoxels) {
  LinearField field;  // one-sided differences at the border give the same slope
  field.expectRadiance(field.shaded(1, 1, 1));
  for (const double range : {2.0, 6.0, 1e3}) {
    field.range = range;
    const double g = 1 / range;
    field.expectRadiance(field.shaded(1 - (1 - g) * (1 - g), 1, 1));
  }
}

TEST(ExactLight, OnAConstantFieldIsNone) {
  LinearField field;
  field.a = glm::dvec3(0);
  field.expectRadiance(kColor);
  field.offset = 0.7;
  field.expectRadiance(kColor);
  field.range = 0;  // a step
  field.expectRadiance(kColor);
}

TEST(ExactLight, OnAStepShadesEveryGradientFully) {
  LinearField field;
  field.range = 0;
  field.expectRadiance(field.shaded(1, 1, 1));
  field.a = {0, 0, 1e-6};
  field.expectRadiance(field.shaded(1, 1, 1));
}

TEST(ExactLight, OnGradientsWhoseSquaresOverflowOrUnderflowIsThatOfOthers) {
  LinearField field;
  for (const double scale : {1e-40, 1e-30, 1e-20, 1e20, 1e30, 5e36}) {
    field.a = {0, 0, scale};
    field.range = 4 * scale;
    const double g = 0.25;
    // Denormal values have few digits: 1e-40 is accurate to 1e-5.
    field.expectRadiance(field.shaded(1 - (1 - g) * (1 - g), 1, 1), scale < 1e-38 ? 1e-4 : 1e-5);
  }
}

TEST(ExactLight, OnIntegersOfFullRangeIsThatOfTheirSlope) {
  LinearField field;
  field.range = 255;
  field.a = {0, 0, 40};
  const double g = 40.0 / 255;
  field.expectRadiance<std::uint8_t>(field.shaded(1 - (1 - g) * (1 - g), 1, 1));
  field.range = 65535;
  field.a = {0, 0, 10000};
  const double h = 10000.0 / 65535;
  field.expectRadiance<std::uint16_t>(field.shaded(1 - (1 - h) * (1 - h), 1, 1));
}

TEST(ExactLight, OnSpacingsOfOneToAHundredHasTheNormalOfTheWorld) {
  // Voxels of 1 along x and 100 along z: with a = (1, 0, 100) per voxel, the gradient in world space is 1
  // along x and 1 along z.
  LinearField field;
  field.grid = gridOf({5, 6, 7}, {1, 1, 100});
  field.density = 0.005;
  field.a = {1, 0, 100};
  field.range = 4;
  field.lights[0].vector = {0, 0, 1};
  const double g = std::sqrt(2.0) / 4, s = 1 - (1 - g) * (1 - g), nl = std::sqrt(0.5);
  field.expectRadiance(field.shaded(s, nl, nl));
  field.lights[0].vector = {1, 0, 0};  // grazes n = (-1, 0, -1) / sqrt 2 at 45 degrees; h along (-1, 0, -1)
  field.expectRadiance(field.shaded(s, nl, 1));
}

/// A field that rises along an axis at right angles to the view, apart from `tilt`, in a rotated grid. The
/// light comes from the side to which the field rises. `slope`: data values per stored value.
double litAtRightAngles(double turn, double tilt, Method method, double slope = 1) {
  const glm::dvec3 across = glm::normalize(glm::dvec3(std::cos(turn), std::sin(turn), 0.3)),
                   view = glm::normalize(glm::cross(across, glm::dvec3(0.2, 0.1, 1))),
                   up = glm::cross(view, across);
  Grid grid = gridOf({5, 6, 7});
  grid.worldFromVoxel = glm::dmat4(glm::dvec4(0.0105778 * across, 0), glm::dvec4(0.0344994 * up, 0),
                                   glm::dvec4(0.0389877 * view, 0), glm::dvec4(0.3, -0.2, 0.1, 1));
  const auto volume =
      volumeOf(grid, channelOf<std::int16_t>(
                         grid.dims, [&](int x, int, int) { return 1000 * x / slope; }, slope));
  Scene scene = frontScene(*volume, 8, 8);
  scene.camera.eye = scene.camera.target - grid.diagonal() * glm::normalize(view + tilt * across);
  scene.camera.up = up;
  scene.camera.orthoHeight = 0.03;
  scene.channels[0] = solid(1000, kColor);
  scene.channels[0].rangeHi = 1000;
  scene.channels[0].material = {0, 1, 0, 1};
  scene.shading = true;
  scene.lights = {{LightType::directional, -across, glm::dvec3(1), 1}};
  double lit = 0;
  int seen = 0;
  for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 2).pixels) {
    if (!(pixel.a > 0.9f)) continue;
    ++seen;
    lit += double(pixel.r / pixel.a) / kColor.r;
  }
  EXPECT_GT(seen, 30);
  return lit / seen;
}

TEST(ExactLight, OnAFieldThatIsConstantAlongTheViewIsNotDecidedByRounding) {
  for (int i = 0; i < 20; ++i)
    for (const Method method : {Method::superposed, Method::raymarch}) {
      EXPECT_NEAR(litAtRightAngles(0.31 * i, 0, method), 1, 1e-4) << i << ' ' << nameOf(method);
      EXPECT_NEAR(litAtRightAngles(0.31 * i, 0, method, -1), 1, 1e-4) << i << ' ' << nameOf(method);
      // The normal turns to the viewer where it clearly points away from it.
      EXPECT_NEAR(litAtRightAngles(0.31 * i, 1e-5, method), 0, 1e-4) << i << ' ' << nameOf(method);
      EXPECT_NEAR(litAtRightAngles(0.31 * i, -1e-5, method), 1, 1e-4) << i << ' ' << nameOf(method);
    }
}

TEST(ExactLight, FromExactlyBehindHasNoHighlight) {
  // Light and view direction cancel: rounding decides where the half vector points. Also with rotated grids.
  LinearField field;
  field.material.shininess = 1;
  field.a = {0.7, 0.1, 0.3};
  field.range = 1e-3;
  field.lights[0].vector = {0, 0, -1};
  field.expectRadiance(field.shaded(1, 0, 0));
  for (const double angle : {0.3, 0.7, 1.1, 2.0}) {
    const double c = std::cos(angle), s = std::sin(angle);
    const auto volume = [&] {
      Grid turned = gridOf({6, 6, 6}, {1, 1.3, 0.7}, {-3, -3, -3});
      const glm::dmat4 rotation(glm::dvec4(c, s * 0.6, s * 0.8, 0), glm::dvec4(-s, c * 0.6, c * 0.8, 0),
                                glm::dvec4(0, -0.8, 0.6, 0), glm::dvec4(0, 0, 0, 1));
      turned.worldFromVoxel = rotation * turned.worldFromVoxel;
      return volumeOf(turned, channelOf<float>(turned.dims, [](int x, int y, int z) {
                        return 0.7 * x + 0.1 * y + 0.3 * z;
                      }));
    }();
    Scene scene = frontScene(*volume, 12, 12);
    scene.camera.eye = scene.camera.target + glm::dvec3(3, 5, -7);
    scene.camera.orthoHeight = 4;
    scene.channels[0] = solid(0.5, kColor);
    scene.channels[0].rangeHi = 1e-3;
    scene.channels[0].material = field.material;
    scene.lights = {{LightType::directional, {3, 5, -7}, glm::dvec3(1), 1}};
    scene.shading = true;
    int seen = 0;
    for (const Method method : kAllMethods)
      for (const glm::vec4& p : renderAnalog(volume, scene, method, 2).pixels) {
        if (!(p.a > 0.1f)) continue;
        ++seen;
        for (int i = 0; i < 3; ++i)
          ASSERT_NEAR(double(p[i] / p.a), 0.1 * kColor[i], 1e-5) << nameOf(method) << " angle " << angle;
      }
    EXPECT_GT(seen, 300);
  }
}

TEST(ExactLight, OfNoIntensityLeavesTheAmbientShare) {
  LinearField field;
  field.lights[0].intensity = 0;
  for (const bool shadows : {false, true}) {
    field.shadows = shadows;
    field.expectRadiance(field.shaded(1, 0, 0));
    field.range = 4;  // no light that could be shadowed: unshaded points keep their colour
    const double s = 1 - 0.75 * 0.75;
    field.expectRadiance(field.shaded(s, 0, 0));
    field.range = 1;
  }
}

TEST(ExactLight, ThatNothingIsInTheWayOfIsNotDimmedBySwitchingShadowsOn) {
  LinearField field;
  field.density = 1e-4;  // one shadow ray in a thousand would be blocked
  const auto volume =
      volumeOf(field.grid, channelOf<float>(field.grid.dims, [](int, int, int z) { return z; }));
  Scene scene = frontScene(*volume, 32, 32);
  scene.channels[0] = solid(field.density, kColor);
  scene.channels[0].rangeHi = 4;
  scene.channels[0].material = field.material;
  scene.lights = {{LightType::directional, {0, 0, 1}, {1, 0.5, 2}, 0.6},
                  {LightType::point, {1, 2, -9}, glm::dvec3(1), 0.3}};
  for (const bool shading : {false, true})
    for (const Method method : kAllMethods) {
      scene.shading = shading;
      const auto radiance = [&](bool shadows) {
        scene.shadows = shadows;
        glm::dvec4 sum(0);
        for (const glm::vec4& p : renderAnalog(volume, scene, method, 200).pixels) sum += glm::dvec4(p);
        EXPECT_GT(sum.a, 0.1);  // with trackers, 140 collisions
        return glm::dvec3(sum) / sum.a;
      };
      const glm::dvec3 without = radiance(false), with = radiance(true);
      // At most one of the two lights is blocked, at two of the collisions; plus the ray's own jitter.
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(with[c] / without[c], 1, 0.02) << nameOf(method) << shading;
    }
}

TEST(ExactLight, ThatCannotBeIsRefused) {
  const auto volume = volumeOf(gridOf({3, 3, 3}), channelOf<float>({3, 3, 3}, lumps()));
  const auto renderer = makeCpuRenderer(volume, 1);
  const Scene good = frontScene(*volume, 4, 4);
  const auto refused = [&](const Light& light) {
    Scene scene = good;
    scene.shading = true;
    scene.lights = {light};
    EXPECT_THROW(renderer->setScene(scene), Error);
  };
  for (const double bad : {kNaN, kInfinity, -1.0}) {
    refused({LightType::headlight, {}, glm::dvec3(1), bad});
    refused({LightType::headlight, {}, glm::dvec3(1, bad, 1), 1});
  }
  for (const double bad : {kNaN, kInfinity}) {
    refused({LightType::directional, {1, bad, 0}, glm::dvec3(1), 1});
    refused({LightType::point, {1, bad, 0}, glm::dvec3(1), 1});
  }
  refused({LightType::directional, {0, 0, 0}, glm::dvec3(1), 1});
}

TEST(ExactBlend, OfIdenticalChannelsInMaxShowsTheFirstAlone) {
  const glm::ivec3 dims(6, 6, 6);
  std::vector<ChannelSource> sources;
  for (int n = 0; n < 32; ++n) sources.push_back(channelOf<float>(dims, lumps(1)));
  const auto volume = std::make_shared<const Volume>(gridOf(dims), std::move(sources));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, 24);
  scene.blend = BlendMode::max;
  for (int first : {0, 7, 31}) {
    for (int n = 0; n < 32; ++n) {
      auto& channel = scene.channels[std::size_t(n)];
      channel = ramp(0, 1, 0.5, n == first ? kRed : kBlue);
      channel.visible = n >= first;
    }
    for (const Method method : kAllMethods) {
      double red = 0;
      for (const glm::vec4& p : renderAnalog(volume, scene, method, 2).pixels) {
        ASSERT_EQ(p.b, 0) << nameOf(method);
        red += double(p.r);
      }
      EXPECT_GT(red, 50) << nameOf(method);
    }
  }
}

TEST(ExactBlend, OfIdenticalChannelsInMixIsTheirWeightedSum) {
  const glm::ivec3 dims(6, 6, 6);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, lumps(1)),
                               channelOf<float>(dims, lumps(1)), channelOf<float>(dims, lumps(1)));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, 24);
  scene.blend = BlendMode::mix;
  const double weights[] = {0, 0.25, 3};  // a weight of 0 hides the colour, not the extinction
  for (std::size_t n = 0; n < 3; ++n) {
    scene.channels[n] = ramp(0, 1, 0.5, glm::dvec3(n == 0, n == 1, n == 2));
    scene.channels[n].weight = weights[n];
  }
  for (const Method method : kAllMethods)
    for (const glm::vec4& p : renderAnalog(volume, scene, method, 2).pixels)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(double(p[c]), weights[c] * double(p.a), 1e-5) << nameOf(method) << " component " << c;
}

TEST(Light, OnAChannelAsThinAsFloatsCanSayChangesNothing) {
  // Its share of a stratum, or the reciprocal of the share, is outside the range of floats.
  const glm::ivec3 dims(6);
  for (const float thin : {1.0f, 1e3f, 1e6f, 1e9f}) {
    const auto volume = volumeOf(gridOf(dims, glm::dvec3(0.25)), channelOf<float>(dims, lumps()),
                                 channelOf<float>(dims, [&](int, int, int) { return thin * 1.4e-45f; }));
    Scene scene = frontScene(*volume, 12, 12);
    scene.channels[0] = scene.channels[1] = ramp(0, 1, 1, kBlue);
    scene.shading = scene.shadows = true;
    Scene alone = scene;
    alone.channels[1].visible = false;
    for (const Method method : {Method::raymarch, Method::hybrid}) {
      const Image found = renderAnalog(volume, scene, method, 4);
      const Image expected = renderAnalog(volume, alone, method, 4);
      for (std::size_t i = 0; i < found.pixels.size(); ++i)
        for (int c = 0; c < 4; ++c)
          ASSERT_NEAR(found.pixels[i][c], expected.pixels[i][c], 1e-6) << nameOf(method) << " pixel " << i;
    }
  }
}

}  // namespace
}  // namespace scolopax
