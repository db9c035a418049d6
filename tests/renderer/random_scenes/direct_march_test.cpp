// SPDX-License-Identifier: Apache-2.0
// directMarch() against closed forms.
#include "tests/renderer/random_scenes/direct_march.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/volumes.h"

namespace scolopax::random_scenes {
namespace {

using namespace test;

struct Drawing {
  VolumeSource source;
  Scene scene;
};
Drawing drawing(ChannelSource channel, glm::ivec3 dims) {
  Drawing made;
  made.source.grid = gridOf(dims);
  made.source.channels.push_back(std::move(channel));
  made.scene.channels.resize(1);
  made.scene.filter = PixelFilter::point;
  made.scene.width = made.scene.height = 1;
  made.scene.camera.target = glm::dvec3(dims - 1) * 0.5;
  made.scene.camera.eye = made.scene.camera.target - glm::dvec3(0, 0, 10);
  made.scene.camera.orthoHeight = 1e-9;
  return made;
}

TEST(DirectMarch, OfAConstantVolumeIsTheExponential) {
  const glm::ivec3 dims(2, 3, 4);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int) { return 0.5; }), dims);
  d.scene.channels[0] = solid(0.7, {0.25, 0.5, 1});
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  const double alpha = 1 - std::exp(-0.7 * 4);
  for (int c = 0; c < 4; ++c)
    EXPECT_NEAR(found.rgba[c], alpha * glm::dvec4(0.25, 0.5, 1, 1)[c], found.error + 1e-12) << c;
  EXPECT_LT(found.error, 1e-6);
}

// A spike of opacity on a ramp from 0 to 1 over four voxels: its optical thickness is its area.
TEST(DirectMarch, FindsASpikeFarNarrowerThanItsSteps) {
  const glm::ivec3 dims(1, 1, 5);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int z) { return z / 4.0; }), dims);
  d.scene.channels[0].density = 3000;
  d.scene.channels[0].opacity = {{0, 0}, {0.3, 0}, {0.30005, 1}, {0.3001, 0}};
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.a, 1 - std::exp(-3000 * 0.00005 * 4), found.error + 1e-9);
  EXPECT_LT(found.error, 1e-5);
}

// |gradient| of z^2 is 2z from the second voxel to the last but one: the factor is a half from 2 to 6.
TEST(DirectMarch, TakesOpacityByTheGradient) {
  const glm::ivec3 dims(1, 1, 8);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int z) { return z * z; }), dims);
  d.scene.channels[0] = solid(0.7);
  d.scene.channels[0].gradientOpacity =
      GradientOpacity{0, 16, {{0.25, 0}, {0.25, 0.5}, {0.75, 0.5}, {0.75, 0}}};
  Marched found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.a, 1 - std::exp(-0.7 * 4 / 2), found.error + 1e-9);
  EXPECT_LT(found.error, 1e-5);
  // Around a voxel that is not finite, points whose differences reach into its cells have no gradient: [1,
  // 5].
  d.source.channels[0] = channelOf<float>(
      dims, [](int, int, int z) { return z == 3 ? std::numeric_limits<double>::quiet_NaN() : z; });
  d.scene.channels[0].gradientOpacity = GradientOpacity{0, 1, {{0, 1}}};
  found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.a, 1 - std::exp(-0.7 * 4), found.error + 1e-9);
}

// |gradient| of |z - 4| dips to 0 at 4.
TEST(DirectMarch, FindsADipOfTheGradientFarNarrowerThanItsSteps) {
  const glm::ivec3 dims(1, 1, 9);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int z) { return std::abs(z - 4); }), dims);
  d.scene.channels[0] = solid(1e4);
  d.scene.channels[0].gradientOpacity = GradientOpacity{0, 1, {{0, 1}, {1e-4, 1}, {1e-4, 0}}};
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.a, 1 - std::exp(-2), found.error + 1e-9);
  EXPECT_LT(found.error, 1e-5);
}

// Every voxel is a slab with its own opacity. A voxel that is not finite leaves a gap between its faces, at
// which there is no surface.
TEST(DirectMarch, TakesTheNearestVoxel) {
  const glm::ivec3 dims(1, 1, 5);
  Drawing d = drawing(
      channelOf<float>(dims,
                       [](int, int, int z) { return z == 1 ? std::numeric_limits<double>::quiet_NaN() : z; }),
      dims);
  d.scene.channels[0].interpolation = Interpolation::nearest;
  d.scene.channels[0].density = 0.8;
  d.scene.channels[0].rangeHi = 4;
  d.scene.channels[0].color = {{0, {0, 1, 0}}};
  d.scene.channels[0].isovalues = {{1, 1, glm::dvec3(0, 0, 1)}, {2.5, 0.4, glm::dvec3(1, 0, 0)}};
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  const double before = std::exp(-0.8 * 0.5), all = std::exp(-0.8 * (0.5 + 0.75 + 1));
  EXPECT_NEAR(found.rgba.r, before * 0.4, found.error + 1e-9);
  EXPECT_NEAR(found.rgba.g, 1 - before + 0.6 * (before - all), found.error + 1e-9);
  EXPECT_EQ(found.rgba.b, 0);
  EXPECT_NEAR(found.rgba.a, 1 - 0.6 * all, found.error + 1e-9);
  EXPECT_LT(found.error, 1e-6);
}

// The gradient is that of a ramp, although every voxel is flat.
TEST(DirectMarch, LightsFacesOfVoxelsByTheTrilinearGradient) {
  const glm::ivec3 dims(1, 1, 5);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int z) { return z; }), dims);
  d.scene.channels[0].interpolation = Interpolation::nearest;
  d.scene.channels[0].opacity = {{0, 0}};
  d.scene.channels[0].material = {0, 1, 0, 1};
  d.scene.channels[0].isovalues = {{2, 0.25, glm::dvec3(1, 1, 1)}};
  d.scene.shading = true;
  d.scene.lights = {{LightType::directional, {0, 0.8, 0.6}}};
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.r, 0.25 * 0.6, 1e-6);
  EXPECT_LT(found.error, 1e-6);
}

// One voxel among zeros is the spline's basis function, whose area is 1; beyond the second voxel behind it,
// it is 0, and 1/24 of it lies between that and the first.
TEST(DirectMarch, TakesTheSplineThatTheVoxelsAreTheCoefficientsOf) {
  const glm::ivec3 dims(1, 1, 7);
  double last = 0;
  const auto values = [&](int, int, int z) { return z == 3 ? 1 : z == 6 ? last : 0; };
  Drawing d = drawing(channelOf<float>(dims, values), dims);
  d.scene.channels[0].interpolation = Interpolation::cubic;
  Marched found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.a, 1 - std::exp(-1), found.error + 1e-9);
  EXPECT_LT(found.error, 1e-6);
  // If a voxel is not finite, the cells from the second voxel before it on have no values.
  last = std::numeric_limits<double>::infinity();
  d.source.channels[0] = channelOf<float>(dims, values);
  found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.a, 1 - std::exp(-23.0 / 24), found.error + 1e-9);
  // A constant is met nowhere, not even by rounding.
  d.source.channels[0] = channelOf<float>(dims, [](int, int, int) { return 0.3; });
  d.scene.channels[0].opacity = {{0, 0}};
  d.scene.channels[0].isovalues = {{double(0.3F), 1, {}}};
  EXPECT_EQ(directMarch(d.source, d.scene, 0, 0).rgba.a, 0);
}

// The spline of the coefficients z^2 is z^2 + 1/3 where it does not reach the border: as above, the factor is
// a half from 2 to 6, where the opacity ends.
TEST(DirectMarch, TakesOpacityByTheGradientOfTheSpline) {
  const glm::ivec3 dims(1, 1, 9);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int z) { return z * z; }), dims);
  const double end = (36 + 1.0 / 3) / 100;
  d.scene.channels[0].interpolation = Interpolation::cubic;
  d.scene.channels[0].density = 0.7;
  d.scene.channels[0].rangeHi = 100;
  d.scene.channels[0].opacity = {{0, 1}, {end, 1}, {end, 0}};
  d.scene.channels[0].gradientOpacity = GradientOpacity{0, 16, {{0.25, 0}, {0.25, 0.5}, {1, 0.5}}};
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.a, 1 - std::exp(-0.7 * 4 / 2), found.error + 1e-9);
  EXPECT_LT(found.error, 1e-5);
}

// A plate lit by a headlight that shines through it: A = ka + (1 - ka) exp(-2 s t) / exp(-s t).
TEST(DirectMarch, CastsShadowsOfTheMatterBeforeIt) {
  const glm::ivec3 dims(2, 2, 3);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int) { return 1; }), dims);
  d.scene.channels[0] = solid(0.6);
  d.scene.channels[0].material.ambient = 0.25;
  d.scene.shadows = true;
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  const double once = 1 - std::exp(-0.6 * 3), twice = (1 - std::exp(-2 * 0.6 * 3)) / 2;
  EXPECT_NEAR(found.rgba.r, 0.25 * once + 0.75 * twice, found.error + 1e-6);
  EXPECT_LT(found.error, 1e-3);
}

// A plane of opacity 0.4 in the middle of matter, and one of opacity 0.5 at the same place.
TEST(DirectMarch, MeetsSurfacesInMatter) {
  const glm::ivec3 dims(1, 1, 5);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int z) { return z; }), dims);
  d.scene.channels[0] = solid(0.3, {0, 1, 0});
  d.scene.channels[0].isovalues = {{1.75, 0.4, glm::dvec3(1, 0, 0)}, {1.75, 0.5, glm::dvec3(0, 0, 1)}};
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  const double before = std::exp(-0.3 * 2.25), all = std::exp(-0.3 * 5);
  EXPECT_NEAR(found.rgba.r, before * 0.4, found.error + 1e-9);
  EXPECT_NEAR(found.rgba.g, 1 - before + 0.3 * (before - all), found.error + 1e-9);
  EXPECT_NEAR(found.rgba.b, before * 0.6 * 0.5, found.error + 1e-9);
  EXPECT_NEAR(found.rgba.a, 1 - 0.3 * all, found.error + 1e-9);
  EXPECT_LT(found.error, 1e-6);
}

// Along the ray the field rises by only 10 a voxel, and the contributions of x, y and z, which cancel, are
// rounded: the value passes the surfaces' values several times.
TEST(DirectMarch, MeetsASurfaceOnceWhereRoundingPassesItOften) {
  const glm::ivec3 dims(4, 4, 4);
  Drawing d = drawing(
      channelOf<float>(dims, [](int x, int y, int z) { return 10000 + 1010 * z - 500 * x - 500 * y; }), dims);
  d.scene.channels[0].opacity = {{0, 0}};
  for (int i = 0; i < 8; ++i) d.scene.channels[0].isovalues.push_back({10011 + 1.3 * i, 0.1, glm::dvec3(1)});
  d.scene.camera.target += glm::dvec3(0.01, 0.02, 0);
  d.scene.camera.eye = d.scene.camera.target - glm::dvec3(4, 4, 4);
  for (const Interpolation how : {Interpolation::trilinear, Interpolation::cubic}) {
    d.scene.channels[0].interpolation = how;
    EXPECT_NEAR(directMarch(d.source, d.scene, 0, 0).rgba.a, 1 - std::pow(0.9, 8), 1e-9) << int(how);
  }
}

// The light comes from behind through the second surface, which takes half of it; n.l is 1 on the other side.
TEST(DirectMarch, ShadowsSurfacesButNotByThemselves) {
  const glm::ivec3 dims(1, 1, 7);
  Drawing d = drawing(channelOf<float>(dims, [](int, int, int z) { return z; }), dims);
  d.scene.channels[0].opacity = {{0, 0}};
  d.scene.channels[0].material = {0, 1, 0, 1};
  d.scene.channels[0].isovalues = {{2, 0.25, glm::dvec3(1, 0, 0)}, {4, 0.5, glm::dvec3(0, 1, 0)}};
  d.scene.shadows = true;
  d.scene.lights = {{LightType::directional, {0, 0, -1}}};
  const Marched found = directMarch(d.source, d.scene, 0, 0);
  EXPECT_NEAR(found.rgba.r, 0.25 * 0.5, 1e-6);
  EXPECT_NEAR(found.rgba.g, 0.75 * 0.5, 1e-6);
  EXPECT_LT(found.error, 1e-6);
}

// Shaded matter with a rotating normal: a march of 20,000 equal steps gives .22801.
TEST(DirectMarch, ShadesNormalsThatTurnAlongTheRay) {
  const glm::ivec3 dims(2, 2, 2);
  constexpr int kBytes[] = {255, 0, 255, 0, 0, 255, 255, 255};
  Drawing d = drawing(
      channelOf<std::uint8_t>(dims, [&](int x, int y, int z) { return kBytes[x + 2 * y + 4 * z]; }), dims);
  d.scene.channels[0] = solid(1);
  d.scene.channels[0].rangeHi = 255;
  d.scene.channels[0].material = {0, 1, 0, 20};
  d.scene.shading = true;
  d.scene.lights = {{LightType::directional, {1, 0, 0}}};
  d.scene.width = d.scene.height = 8;
  d.scene.camera.eye = {5, 4, 3};
  d.scene.camera.target = {0.5, 0.5, 0.5};
  d.scene.camera.up = {0, 0, 1};
  d.scene.camera.orthoHeight = 2;
  const Marched found = directMarch(d.source, d.scene, 6, 4);
  EXPECT_NEAR(found.rgba.r, 0.22801, 5e-5);
  EXPECT_LT(found.error, 2e-4);
}

}  // namespace
}  // namespace scolopax::random_scenes
