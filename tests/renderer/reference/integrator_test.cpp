// SPDX-License-Identifier: Apache-2.0
// Cases with a closed-form answer.
#include "renderer/reference/integrator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "renderer/core/error.h"
#include "tests/renderer/reference/test_volumes.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {
namespace {

using namespace test;

constexpr double kPi = 3.14159265358979323846;
/// A box of 4 x 6 x 2.5 world units around `centre`.
Volume box(glm::dvec3 centre) {
  return makeVolume(gridOf({4, 3, 5}, {1, 2, 0.5}, centre - glm::dvec3(1.5, 2, 1)),
                    {[](int, int, int) { return 3; }});
}

TEST(Reference, HomogeneousBoxFromOutsideAlongEachAxis) {
  const Volume volume = box({7, -8, 9});
  const Scene scene = makeScene({solid(0.7, kOrange)});
  const double lengths[3] = {4, 6, 2.5};
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) {
      glm::dvec3 direction(0);
      direction[axis] = sign;
      const double alpha = 1 - std::exp(-0.7 * lengths[axis]);
      const glm::dvec3 through = glm::dvec3(7, -8, 9) + glm::dvec3(0.3, 0.4, -0.2);
      expectColor(traceReference(volume, scene, through - 50.0 * direction, direction), alpha * kOrange,
                  alpha, 1e-12);
    }
}

TEST(Reference, HomogeneousBoxObliquely) {
  const glm::dvec3 centre(7, -8, 9);
  const Volume volume = box(centre);
  const Scene scene = makeScene({solid(0.7, kOrange)});
  for (const glm::dvec3 d : {glm::dvec3(1, 1, 1), glm::dvec3(-1, 2, 0.3), glm::dvec3(0.01, -0.02, 1)}) {
    const glm::dvec3 unit = glm::normalize(d);
    const double length = 2 * std::min({2 / std::abs(unit.x), 3 / std::abs(unit.y), 1.25 / std::abs(unit.z)});
    const double alpha = 1 - std::exp(-0.7 * length);
    expectColor(traceReference(volume, scene, centre - 100.0 * unit, 5.0 * d), alpha * kOrange, alpha, 1e-11);
  }
}

TEST(Reference, HomogeneousBoxFromInsideAFaceAnEdgeAndACorner) {
  const glm::dvec3 centre(7, -8, 9);
  const Volume volume = box(centre);
  const Scene scene = makeScene({solid(0.7, kRed)});
  const auto alpha = [&](const glm::dvec3& from, const glm::dvec3& d) {
    return traceReference(volume, scene, centre + from, d).rgba.a;
  };
  EXPECT_NEAR(alpha({0.5, 0, 0}, {1, 0, 0}), 1 - std::exp(-0.7 * 1.5), 1e-12);
  EXPECT_NEAR(alpha({0.5, 0, 0}, {-1, 0, 0}), 1 - std::exp(-0.7 * 2.5), 1e-12);
  EXPECT_NEAR(alpha({-2, 0, 0}, {1, 0, 0}), 1 - std::exp(-0.7 * 4), 1e-12);      // on a face, inwards
  EXPECT_NEAR(alpha({-2, 0, 0}, {-1, 0, 0}), 0, 1e-12);                          // and outwards
  EXPECT_NEAR(alpha({-2, -3, 0}, {0, 0, 1}), 1 - std::exp(-0.7 * 1.25), 1e-12);  // along an edge
  EXPECT_NEAR(alpha({-2, -3, -1.25}, {4, 6, 2.5}), 1 - std::exp(-0.7 * std::sqrt(16 + 36 + 6.25)), 1e-12);
}

TEST(Reference, RaysAlongFacesAndEdgesCountAsInsideAndThoseBesideAsOutside) {
  const Scene scene = makeScene({solid(0.7, kRed)});
  for (const double offset : {0.0, 1e6}) {
    const Volume volume = box(glm::dvec3(offset));
    const double alpha = 1 - std::exp(-0.7 * 4);
    const auto along = [&](double y, double z) {
      return traceReference(volume, scene, glm::dvec3(offset) + glm::dvec3(-9, y, z), {1, 0, 0}).rgba.a;
    };
    EXPECT_NEAR(along(-3, 0.1), alpha, 1e-8);
    EXPECT_NEAR(along(3, 0.1), alpha, 1e-8);
    EXPECT_NEAR(along(3, 1.25), alpha, 1e-8);
    EXPECT_EQ(along(-3.001, 0.1), 0);
    EXPECT_EQ(along(3, 1.251), 0);
  }
}

TEST(Reference, WhatLiesBehindTheOriginIsNotSeen) {
  const Volume volume = box(glm::dvec3(0));
  EXPECT_EQ(traceReference(volume, makeScene({solid(5, kRed)}), {10, 0, 0}, {1, 0, 0}).rgba, glm::dvec4(0));
}

TEST(Reference, LinearDensityWithALinearColormapMatchesTheErrorFunction) {
  const int n = 9;
  const double spacing = 0.5, ramped = (n - 1) * spacing;
  const Volume volume = rampAlongX({n, 2, 3}, glm::dvec3(spacing));
  for (const double density : {1e-3, 0.8, 30.0, 5e5}) {
    ChannelAppearance appearance = ramp(0, n - 1, density);
    appearance.color = {{0, {0, 0, 1}}, {1, {1, 0, 1}}};
    // sigma = D x/L, red = x/L over the ramp of length L, then half a voxel of D and 1.
    const double s = density * ramped / 2, last = density * spacing / 2;
    const double alpha = -std::expm1(-(s + last));
    const double red =
        -std::exp(-s) + std::sqrt(kPi / (4 * s)) * std::erf(std::sqrt(s)) - std::exp(-s) * std::expm1(-last);
    const RayResult found = traceReference(volume, makeScene({appearance}), {-3, 0.2, 0.3}, {1, 0, 0});
    expectColor(found, {red, 0, alpha}, alpha, 1e-9);
    EXPECT_NEAR(found.rgba.r / red, 1, 1e-6) << density;
  }
}

TEST(Reference, OpticalThicknessFromOneMillionthToOneMillion) {
  const Volume volume = box(glm::dvec3(0));
  for (double thickness = 1e-6; thickness < 2e6; thickness *= 10) {
    const RayResult found =
        traceReference(volume, makeScene({solid(thickness / 4, kOrange)}), {-9, 0.1, 0.1}, {1, 0, 0});
    const double alpha = -std::expm1(-thickness);
    EXPECT_NEAR(found.rgba.a / alpha, 1, 1e-10) << thickness;
    EXPECT_NEAR(found.rgba.g / (0.5 * alpha), 1, 1e-7) << thickness;
  }
}

TEST(Reference, AThickFrontHidesWhatIsBehindAndAThinOneAddsUp) {
  // Two halves along x: value 0 is red, 1 is blue, and the change between them takes one voxel.
  const Volume volume = makeVolume(gridOf({8, 1, 1}), {[](int i, int, int) { return i < 4 ? 0 : 1; }});
  ChannelAppearance appearance = solid(1e6, kRed);
  appearance.color = {{0, kRed}, {0.5, kRed}, {0.5, kBlue}, {1, kBlue}};
  expectColor(traceReference(volume, makeScene({appearance}), {-5, 0, 0}, {1, 0, 0}), kRed, 1, 1e-9);
  expectColor(traceReference(volume, makeScene({appearance}), {15, 0, 0}, {-1, 0, 0}), kBlue, 1, 1e-9);
  appearance.density = 0.1;
  const double half = 1 - std::exp(-0.4);
  expectColor(traceReference(volume, makeScene({appearance}), {-5, 0, 0}, {1, 0, 0}),
              half * kRed + std::exp(-0.4) * half * kBlue, 1 - std::exp(-0.8), 1e-12);
}

TEST(Reference, ConstantChannelsShareTheLightByTheirExtinctions) {
  const VoxelFunction one = [](int, int, int) { return 1; };
  const Volume volume = makeVolume(gridOf({3, 3, 3}), {one, one, one});
  Scene scene = makeScene({solid(0.25, kRed), solid(1.5, kOrange), solid(9, kBlue)});
  scene.channels[2].visible = false;
  const double alpha = 1 - std::exp(-1.75 * 3);
  expectColor(traceReference(volume, scene, {1, 1, -7}, {0, 0, 1}),
              (0.25 * kRed + 1.5 * kOrange) * (alpha / 1.75), alpha, 1e-12);
  scene.channels[0].visible = scene.channels[1].visible = false;
  EXPECT_EQ(traceReference(volume, scene, {1, 1, -7}, {0, 0, 1}).rgba, glm::dvec4(0));
}

TEST(Reference, Figure3SeenAlongZSplitsTheLightInClosedForm) {
  const Figure3 figure;
  for (const double x : {-0.5, 0.0, 1.25, 3.5, 7.4})
    for (const double y : {-0.3, 2.0, 6.75}) {
      const glm::dvec3 sigma = Figure3::sigma({x, y, 0});
      const double sum = sigma.x + sigma.y + sigma.z, alpha = 1 - std::exp(-sum * Figure3::n);
      expectColor(traceReference(figure.volume, figure.scene, {x, y, -4}, {0, 0, 1}), sigma * (alpha / sum),
                  alpha, 1e-12);
    }
}

TEST(Reference, Figure3SeenObliquelyMatchesAMillionMidpoints) {
  const Figure3 figure;
  const glm::dvec3 direction = glm::normalize(glm::dvec3(-2, 1, 1.5)),
                   origin = glm::dvec3(3.4, 3.7, 3.1) - 20.0 * direction;
  // Entry and exit of the box [-0.5, 7.5]^3.
  double begin = 0, end = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-0.5 - origin[axis]) / direction[axis], b = (7.5 - origin[axis]) / direction[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  ASSERT_LT(begin, end);
  constexpr int kSteps = 1000000;
  const double dt = (end - begin) / kSteps;
  glm::dvec3 color(0);
  double depth = 0;
  for (int i = 0; i < kSteps; ++i) {
    const glm::dvec3 sigma = Figure3::sigma(origin + (begin + (i + 0.5) * dt) * direction);
    const double step = (sigma.x + sigma.y + sigma.z) * dt;
    color += std::exp(-depth - 0.5 * step) * dt * sigma;
    depth += step;
  }
  expectColor(traceReference(figure.volume, figure.scene, origin, direction), color, 1 - std::exp(-depth),
              1e-9);
}

TEST(Reference, RefusesScenesAndRaysThatDoNotFit) {
  const Volume volume = box(glm::dvec3(0));
  EXPECT_THROW(traceReference(volume, makeScene({}), {0, 0, 0}, {1, 0, 0}), Error);
  const Scene scene = makeScene({solid(1, kRed)});
  EXPECT_THROW(traceReference(volume, scene, {0, 0, 0}, {0, 0, 0}), Error);
  EXPECT_THROW(traceReference(volume, scene, {std::numeric_limits<double>::quiet_NaN(), 0, 0}, {1, 0, 0}),
               Error);
  EXPECT_THROW(traceReference(volume, scene, {0, 0, 0}, {std::numeric_limits<double>::infinity(), 0, 0}),
               Error);
}

}  // namespace
}  // namespace scolopax::reference
