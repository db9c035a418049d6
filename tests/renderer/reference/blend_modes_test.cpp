// SPDX-License-Identifier: Apache-2.0
// The reference with several channels in each blend mode, against closed forms and tiny steps.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "renderer/core/error.h"
#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/test_volumes.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {
namespace {

using namespace test;

/// Three constant channels of extinction 0.25, 1.5 and 0.9 in a box 3 long.
struct Constant {
  Volume volume =
      makeVolume(gridOf({3, 3, 3}), std::vector<VoxelFunction>(3, [](int, int, int) { return 1; }));
  Scene scene = makeScene({solid(0.25, kRed), solid(1.5, kOrange), solid(0.9, kBlue)});
  RayResult trace(BlendMode mode) {
    scene.blend = mode;
    return traceReference(volume, scene, {1, 1, -7}, {0, 0, 1});
  }
};

TEST(ReferenceBlend, MaxOfConstantChannelsShowsTheThickest) {
  const double alpha = 1 - std::exp(-4.5);
  expectColor(Constant{}.trace(BlendMode::max), alpha * kOrange, alpha, 1e-12);
}

TEST(ReferenceBlend, MaxOfHiddenChannelsIsNotSeen) {
  Constant constant;
  constant.scene.channels[1].visible = false;
  const double alpha = 1 - std::exp(-2.7);
  expectColor(constant.trace(BlendMode::max), alpha * kBlue, alpha, 1e-12);
}

TEST(ReferenceBlend, MaxOfEqualChannelsShowsTheFirst) {
  Constant constant;
  constant.scene.channels[0].density = constant.scene.channels[2].density = 1.5;
  const double alpha = 1 - std::exp(-4.5);
  expectColor(constant.trace(BlendMode::max), alpha * kRed, alpha, 1e-12);
}

TEST(ReferenceBlend, MaxOfChannelsThatAreEqualButForRoundingShowsTheFirstAndEnds) {
  // One field in units that differ by factors of a third and a tenth, over ranges scaled by the same factors.
  const VoxelFunction lumpy = [](int i, int j, int k) { return (i * 7 + j * 5 + k * 3) % 11; };
  const Grid grid = gridOf({5, 5, 5});
  std::vector<ChannelSource> sources;
  for (const double slope : {0.3, 0.1, 1.0 / 3}) {
    ChannelSource source;
    source.voxels = VoxelBuffer(ScalarType::u8, grid.voxelCount());
    source.slope = slope;
    auto out = source.voxels.as<std::uint8_t>().begin();
    for (int k = 0; k < 5; ++k)
      for (int j = 0; j < 5; ++j)
        for (int i = 0; i < 5; ++i) *out++ = std::uint8_t(lumpy(i, j, k));
    sources.push_back(std::move(source));
  }
  const Volume volume(grid, std::move(sources));
  Scene scene = makeScene({ramp(0, 10 * 0.3, 0.3, {1, 0, 0}), ramp(0, 10 * 0.1, 0.3, {0, 1, 0}),
                           ramp(0, 10.0 / 3, 0.3, {0, 0, 1})});
  scene.blend = BlendMode::max;
  const RayResult found = traceReference(volume, scene, {-9, 1.3, 0.7}, {1, 0.1, 0.2});
  EXPECT_GT(found.rgba.a, 0.3);
  EXPECT_NEAR(found.rgba.r, found.rgba.a, 1e-7);
  EXPECT_NEAR(found.rgba.g + found.rgba.b, 0, 1e-9);
}

TEST(ReferenceBlend, MixOfConstantChannelsWeightsAllByExtinctionAndWeight) {
  Constant constant;
  const double alpha = 1 - std::exp(-4.5);
  expectColor(constant.trace(BlendMode::mix), (0.25 * kRed + 1.5 * kOrange + 0.9 * kBlue) * (alpha / 1.5),
              alpha, 1e-12);
  // Weights are neither normalised nor clipped, and do not change the extinction.
  constant.scene.channels[0].weight = 40;
  constant.scene.channels[1].weight = 0;
  constant.scene.channels[2].weight = 0.5;
  expectColor(constant.trace(BlendMode::mix), (10.0 * kRed + 0.45 * kBlue) * (alpha / 1.5), alpha, 1e-11);
}

TEST(ReferenceBlend, CompositeOfConstantChannelsAddsPicturesAndMultipliesTransmittances) {
  const glm::dvec3 color =
      (1 - std::exp(-0.75)) * kRed + (1 - std::exp(-4.5)) * kOrange + (1 - std::exp(-2.7)) * kBlue;
  expectColor(Constant{}.trace(BlendMode::composite), color, 1 - std::exp(-3 * 2.65), 1e-12);
}

TEST(ReferenceBlend, AllModesOfASingleChannelAreTheSame) {
  const Volume volume = rampAlongX({7, 3, 3});
  Scene scene = makeScene({ramp(0, 6, 0.7, kOrange)});
  const RayResult density = traceReference(volume, scene, {-3, 1, 1}, {1, 0.1, 0.05});
  for (const BlendMode mode : {BlendMode::max, BlendMode::mix, BlendMode::composite}) {
    scene.blend = mode;
    EXPECT_EQ(traceReference(volume, scene, {-3, 1, 1}, {1, 0.1, 0.05}).rgba, density.rgba);
  }
}

/// A red channel that falls from `red` to 0 and a green one that rises from 0 to `green`, along 6 voxels.
struct Crossing {
  static constexpr double red = 0.8, green = 0.3, length = 6;
  Volume volume =
      makeVolume(gridOf({7, 1, 1}), std::vector<VoxelFunction>(2, [](int i, int, int) { return i; }));
  Scene scene = makeScene({ramp(length, 0, red, kRed), ramp(0, length, green, kGreen)});
  void expectHandover(double redDepth, double greenDepth, double tolerance) {
    scene.blend = BlendMode::max;
    const double front = 1 - std::exp(-redDepth);
    expectColor(traceReference(volume, scene, {-3, 0, 0}, {1, 0, 0}),
                {front, (1 - front) * (1 - std::exp(-greenDepth)), 0}, 1 - std::exp(-redDepth - greenDepth),
                tolerance);
  }
};

TEST(ReferenceBlend, MaxOfCrossingRampsChangesChannelWhereTheyCross) {
  const double L = Crossing::length, at = L * Crossing::red / (Crossing::red + Crossing::green);
  Crossing{}.expectHandover(Crossing::red * (0.5 + at - at * at / (2 * L)),
                            Crossing::green * (0.5 + (L * L - at * at) / (2 * L)), 1e-11);
}

TEST(ReferenceBlend, MaxOfRampsBentByGammaChangesChannelWhereTheyCross) {
  Crossing crossing;
  for (ChannelAppearance& channel : crossing.scene.channels) channel.gamma = 2.5;
  const double r = std::pow(Crossing::red, 0.4), g = std::pow(Crossing::green, 0.4), at = r / (r + g);
  crossing.expectHandover(Crossing::red * (0.5 + Crossing::length * (1 - std::pow(1 - at, 3.5)) / 3.5),
                          Crossing::green * (0.5 + Crossing::length * (1 - std::pow(at, 3.5)) / 3.5), 1e-8);
}

TEST(ReferenceBlend, MaxFindsASliverInWhichAnotherChannelIsBarelyLarger) {
  // Along the diagonal x = y = t of one cell: x y = t^2, and a line that is above it for |t - 1/2| < 1/64.
  const double half = 1.0 / 64, constant = 0.25 - half * half, density = 0.9;
  const Volume volume = makeVolume(gridOf({2, 2, 1}), {[](int i, int j, int) { return i * j; },
                                                       [&](int i, int, int) { return i - constant; }});
  Scene scene = makeScene({ramp(-1, 2, density, kRed), ramp(-1, 2, density, kGreen)});
  scene.blend = BlendMode::max;
  const RayResult found = traceReference(volume, scene, {-5, -5, 0}, {1, 1, 0});
  const double perUnit = density / 3 * std::sqrt(2.0), begin = 0.5 - half, end = 0.5 + half;
  const double before = perUnit * (0.5 + begin + begin * begin * begin / 3);
  const double sliver = perUnit * ((1 - constant) * 2 * half + (end * end - begin * begin) / 2);
  const double behind = perUnit * (1 - end + (1 - end * end * end) / 3 + 0.5 * 2);
  const double green = std::exp(-before) * (1 - std::exp(-sliver)),
               alpha = 1 - std::exp(-before - sliver - behind);
  ASSERT_GT(green, 0.005);
  expectColor(found, {alpha - green, green, 0}, alpha, 1e-10);
}

TEST(ReferenceBlend, Figure3InEveryModeMatchesAMillionMidpoints) {
  Figure3 figure;
  figure.scene.channels[1].weight = 0.25;
  const glm::dvec3 direction = glm::normalize(glm::dvec3(-2, 1, 1.5)),
                   origin = glm::dvec3(3.4, 3.7, 3.1) - 20.0 * direction;
  double begin = 0, end = 1e9;  // entry and exit of the box [-0.5, 7.5]^3
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-0.5 - origin[axis]) / direction[axis], b = (7.5 - origin[axis]) / direction[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  ASSERT_LT(begin, end);
  constexpr int kSteps = 1000000;
  const double dt = (end - begin) / kSteps;
  glm::dvec3 density(0), max(0), mix(0), composite(0), depths(0);
  double largestDepth = 0;
  for (int i = 0; i < kSteps; ++i) {
    const glm::dvec3 sigma = Figure3::sigma(origin + (begin + (i + 0.5) * dt) * direction);
    const int top = sigma.x >= sigma.y && sigma.x >= sigma.z ? 0 : sigma.y >= sigma.z ? 1 : 2;
    const double sum = depths.x + depths.y + depths.z, step = sigma.x + sigma.y + sigma.z;
    density += std::exp(-sum - 0.5 * step * dt) * dt * sigma;
    const double through = std::exp(-largestDepth - 0.5 * sigma[top] * dt) * dt;
    max[top] += through * sigma[top];
    mix += through * glm::dvec3(1, 0.25, 1) * sigma;
    composite += glm::exp(-depths - 0.5 * dt * sigma) * dt * sigma;
    depths += sigma * dt;
    largestDepth += sigma[top] * dt;
  }
  const auto trace = [&](BlendMode mode) {
    figure.scene.blend = mode;
    return traceReference(figure.volume, figure.scene, origin, direction);
  };
  const double sum = 1 - std::exp(-depths.x - depths.y - depths.z), most = 1 - std::exp(-largestDepth);
  expectColor(trace(BlendMode::density), density, sum, 1e-9);
  expectColor(trace(BlendMode::max), max, most, 2 * dt);  // a step may contain the change of channel
  expectColor(trace(BlendMode::mix), mix, most, 1e-9);
  expectColor(trace(BlendMode::composite), composite, sum, 1e-9);
  EXPECT_NE(max.x, 0);
  EXPECT_NE(max.y, 0);
  EXPECT_NE(max.z, 0);
}

TEST(ReferenceBlend, RefusesAWeightThatIsNegativeOrNotFinite) {
  Constant constant;
  for (const double bad : {-1.0, std::numeric_limits<double>::infinity()}) {
    constant.scene.channels[1].weight = bad;
    EXPECT_THROW(constant.trace(BlendMode::mix), Error);
  }
}

}  // namespace
}  // namespace scolopax::reference
