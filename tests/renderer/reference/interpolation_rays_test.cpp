// SPDX-License-Identifier: Apache-2.0
// Rays through channels of cubic and nearest interpolation whose answers have a closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/test_volumes.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {
namespace {

using namespace test;

ChannelAppearance with(Interpolation interpolation, ChannelAppearance look) {
  look.interpolation = interpolation;
  return look;
}

/// Rows of voxels along x, one per channel.
Volume rows(const std::vector<std::vector<double>>& values) {
  std::vector<VoxelFunction> functions;
  for (const std::vector<double>& row : values)
    functions.emplace_back([row](int i, int, int) { return row[std::size_t(i)]; });
  return makeVolume(gridOf({int(values[0].size()), 1, 1}), functions);
}

TEST(ReferenceNearest, IsConstantInEveryVoxel) {
  const Scene scene = makeScene({with(Interpolation::nearest, ramp(0, 4, 0.6))});
  EXPECT_NEAR(depthOf(alongX(rows({{1, 4, 0, 3}}), scene)), 0.6 * (1 + 4 + 0 + 3) / 4, 1e-13);
  EXPECT_NEAR(depthOf(alongX(rows({{1, kNaN, 0, 3}}), scene)), 0.6 * (1 + 0 + 3) / 4, 1e-13);
}

TEST(ReferenceNearest, ChangesColourAtFaces) {
  ChannelAppearance look = with(Interpolation::nearest, solid(0.3, kRed));
  look.rangeHi = 2;
  look.color = {{0, kRed}, {0.5, kGreen}, {1, kBlue}};
  const RayResult found = alongX(rows({{0, 0, 1, 2, 2, 2}}), makeScene({look}));
  const double red = -std::expm1(-0.6), green = std::exp(-0.6) - std::exp(-0.9);
  EXPECT_NEAR(found.rgba.r, red, 1e-12);
  EXPECT_NEAR(found.rgba.g, green, 1e-12);
  EXPECT_NEAR(found.rgba.b, std::exp(-0.9) - std::exp(-1.8), 1e-12);
}

TEST(ReferenceNearest, HandsOverAtFacesInMax) {
  Scene scene = makeScene({with(Interpolation::nearest, ramp(0, 4, 1, kRed)), solid(0.5, kBlue)});
  scene.blend = BlendMode::max;
  const RayResult found = alongX(rows({{1, 3, 4, 2, 0}, {0, 0, 0, 0, 0}}), scene);
  const double afterBlue = std::exp(-0.5), afterRed = afterBlue * std::exp(-1.75);
  const double afterTie = afterRed * std::exp(-0.5);  // of equal channels the first is seen
  EXPECT_NEAR(found.rgba.r, afterBlue - afterTie, 1e-12);
  EXPECT_NEAR(found.rgba.b, 1 - afterBlue + afterTie * -std::expm1(-0.5), 1e-12);
}

TEST(ReferenceNearest, HasTheFactorOfTheTrilinearGradient) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const Volume volume = makeVolume(gridOf({5, 4, 5}), {[&](int, int, int) { return unit(random); }});
  ChannelAppearance look = solid(0.4, kRed);  // does not depend on the scalar
  look.gradientOpacity = GradientOpacity{0.1, 0.4, {{0, 0}, {0.5, 1}, {1, 0.3}}};
  for (int ray = 0; ray < 20; ++ray) {
    const glm::dvec3 through = 4.0 * glm::dvec3(unit(random), unit(random), unit(random)),
                     direction(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
    const RayResult trilinear =
        traceReference(volume, makeScene({look}), through - 20.0 * direction, direction);
    const RayResult nearest = traceReference(volume, makeScene({with(Interpolation::nearest, look)}),
                                             through - 20.0 * direction, direction);
    EXPECT_NEAR(nearest.rgba.a, trilinear.rgba.a, nearest.error + trilinear.error + 1e-12);
  }
}

TEST(ReferenceNearest, SurfacesAreFacesBetweenVoxels) {
  ChannelAppearance look = with(Interpolation::nearest, solid(0.3, kGreen));
  look.rangeHi = 10;
  look.isovalues = {{2, 0.4, kRed}};
  const RayResult found = alongX(rows({{0, 1, 2, 3, 4, 5}}), makeScene({look}));
  const double before = std::exp(-0.3 * 2), all = std::exp(-0.3 * 6);  // from -0.5 to 1.5
  EXPECT_NEAR(found.rgba.r, before * 0.4, 1e-12);
  EXPECT_NEAR(found.rgba.g, 1 - before + 0.6 * (before - all), 1e-12);
  const Scene half = makeScene({with(Interpolation::nearest, surfaces({{1, 0.5, kRed}}))});
  for (const auto& [row, crossings] : {std::pair<std::vector<double>, int>{{0, 1, 1, 0}, 2},
                                       {{2, 1, 1, 2}, 0},
                                       {{0, 2, 0, 2}, 3},
                                       {{0, kNaN, 2, 0}, 1},
                                       {{1, 1, 1, 1}, 0}})
    EXPECT_NEAR(1 - alongX(rows({row}), half).rgba.a, std::pow(0.5, crossings), 1e-13);
}

TEST(ReferenceNearest, SurfacesAreNotMetWhereVoxelsTouchAtAnEdge) {
  // From voxel to voxel along a diagonal, where rounding may lead through a third one.
  for (const double spacing : {1.0, 0.3, 0.7})
    for (const int sign : {1, -1}) {
      const Volume volume = makeVolume(gridOf({7, 7, 1}, glm::dvec3(spacing), {0.1, -0.4, 0}),
                                       {[&](int i, int j, int) { return sign > 0 ? i == j : i + j == 6; }});
      const glm::dvec3 centre = glm::dvec3(3, 3, 0) * spacing + glm::dvec3(0.1, -0.4, 0);
      const glm::dvec3 direction = glm::normalize(glm::dvec3(1, sign, 0));
      const Scene scene = makeScene({with(Interpolation::nearest, surfaces({{1, 0.5, kRed}}))});
      EXPECT_EQ(traceReference(volume, scene, centre - 11.0 * direction, direction).rgba.a, 0);
    }
}

TEST(ReferenceNearest, SurfacesCastShadowsButNotOnThemselves) {
  const Volume volume = rows({{0, 1, 2, 3, 4, 5, 6, 7}});
  Scene scene = makeScene({with(Interpolation::nearest, surfaces({{2, 0.4, kRed}, {5, 1, kGreen}}))});
  scene.channels[0].material = {0, 1, 0, 1};
  scene.shadows = true;
  scene.lights = {Light{LightType::directional, {1, 0, 0}, glm::dvec3(1), 1}};
  EXPECT_NEAR(alongX(volume, scene).rgba.x, 0.4, 1e-6);
  EXPECT_NEAR(alongX(volume, scene).rgba.y, 0.6 * 0.6, 1e-6);
  scene.lights[0].vector = {-1, 0, 0};
  EXPECT_NEAR(alongX(volume, scene).rgba.x, 0, 1e-6);
  EXPECT_NEAR(alongX(volume, scene).rgba.y, 0.6, 1e-6);
}

TEST(ReferenceCubic, OfALinearFieldIsThatOfTrilinearInsideTheBorder) {
  // Voxels of the outermost cells are repeated, so that the field is linear from x = 1 to x = 8.
  const Volume volume = rampAlongX({10, 3, 3});
  Scene scene = makeScene({ramp(0, 9, 0.4, kRed)});
  scene.channels[0].opacity = {{0, 0}, {0.3, 0}, {0.3, 1}, {0.5, 0.2}, {0.8, 0.6}, {0.8, 0}};
  scene.channels[0].isovalues = {{3.3, 0.25, kGreen}};
  scene.channels[0].gradientOpacity = GradientOpacity{0, 2, {{0, 0}, {1, 1}}};
  for (const bool shading : {false, true}) {
    scene.shading = shading;
    const RayResult trilinear = traceReference(volume, scene, {-5, 0.6, 1.3}, {1, 0.05, 0});
    Scene smooth = scene;
    smooth.channels[0].interpolation = Interpolation::cubic;
    const RayResult cubic = traceReference(volume, smooth, {-5, 0.6, 1.3}, {1, 0.05, 0});
    ASSERT_GT(trilinear.rgba.a, 0.3);
    for (int c = 0; c < 4; ++c)
      EXPECT_NEAR(cubic.rgba[c], trilinear.rgba[c], cubic.error + trilinear.error + 1e-12);
  }
}

TEST(ReferenceCubic, IntegratesTheSplineOfARow) {
  // The integral of a basis function is 1. The outer voxels, which are repeated, are 0.
  const Volume volume = rows({{0, 0, 3, 1, 4, 0, 0}});
  const Scene scene = makeScene({with(Interpolation::cubic, ramp(0, 8, 0.5))});
  EXPECT_NEAR(depthOf(alongX(volume, scene)), 0.5 * 8 / 8, 1e-12);
}

TEST(ReferenceCubic, VoxelsThatAreNotFiniteEmptyTheCellsThatTheyReach) {
  const Volume volume = rows({{1, 1, 1, 1, kNaN, 1, 1, 1, 1, 1}});
  const Scene scene = makeScene({with(Interpolation::cubic, solid(0.3, kRed))});
  EXPECT_NEAR(depthOf(alongX(volume, scene)), 0.3 * (10 - 4), 1e-12);  // without [2, 6]
}

TEST(ReferenceInterpolation, OfAConstantMeetsAStepAtExactlyItsValue) {
  const Volume volume = makeVolume(gridOf({4, 4, 4}), {[](int, int, int) { return 0.1f; }});
  const double value = double(0.1f);
  for (const Interpolation interpolation : kInterpolations) {
    // A step at exactly the value.
    const RayResult at = traceReference(volume, makeScene({with(interpolation, ramp(value, value, 0.4))}),
                                        {-3, 1.3, 2.2}, {1, 0.1, 0.2});
    EXPECT_NEAR(depthOf(at), 0.4 * 4 * std::sqrt(1.05), 1e-12) << nameOf(interpolation);
    const double above = std::nextafter(value, 1);
    const RayResult below = traceReference(volume, makeScene({with(interpolation, ramp(above, above, 0.4))}),
                                           {-3, 1.3, 2.2}, {1, 0.1, 0.2});
    EXPECT_EQ(below.rgba.a, 0) << nameOf(interpolation);
  }
}

TEST(ReferenceInterpolation, CrossingsAreThoseThatSmallStepsFind) {
  std::mt19937 random(11);
  std::uniform_int_distribution<int> value(0, 3);
  std::uniform_real_distribution<double> place(-0.4, 3.4);
  int crossings[3] = {};
  for (int i = 0; i < 300; ++i) {
    const Interpolation interpolation = kInterpolations[i % 3];
    const Volume volume = makeVolume(gridOf({4, 4, 4}), {[&](int, int, int) { return value(random); }});
    const double isovalue = i % 4 == 0 ? 1.0 : 1.5;
    const glm::dvec3 from(place(random), place(random), -0.5), to(place(random), place(random), 3.5);
    const ScalarField field(volume.channels()[0], {4, 4, 4}, interpolation);
    constexpr int kSteps = 20011;
    int expected = 0;
    bool last = field(from) >= isovalue;
    for (int k = 1; k <= kSteps; ++k) {
      const bool inside = field(from + (to - from) * (double(k) / kSteps)) >= isovalue;
      expected += inside != last;
      last = inside;
    }
    const Scene scene = makeScene({with(interpolation, surfaces({{isovalue, 0.5, kRed}}))});
    const RayResult found = traceReference(volume, scene, from - (to - from), to - from);
    EXPECT_NEAR(-std::log2(1 - found.rgba.a), expected, 1e-9) << i << ' ' << nameOf(interpolation);
    crossings[i % 3] += expected;
  }
  for (const int count : crossings) EXPECT_GT(count, 60);
}

}  // namespace
}  // namespace scolopax::reference
