// SPDX-License-Identifier: Apache-2.0
// Agreement with the simplest possible program, written independently here: tiny steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

const glm::ivec3 kDims(6, 5, 4);

struct Marcher {
  const Volume& volume;
  const Scene& scene;

  double scalarAt(std::size_t n, const glm::dvec3& p) const {
    const Channel& channel = volume.channels()[n];
    const auto voxels = channel.voxels.as<std::uint8_t>();
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      int index[3];
      for (int axis = 0; axis < 3; ++axis) {
        const int low = int(std::floor(p[axis])), bit = corner >> axis & 1;
        weight *= bit ? p[axis] - low : 1 - (p[axis] - low);
        index[axis] = std::clamp(low + bit, 0, kDims[axis] - 1);
      }
      sum += weight * voxels[std::size_t(index[0] + kDims.x * (index[1] + kDims.y * index[2]))];
    }
    return channel.slope * sum + channel.intercept;
  }

  /// Value of a curve. Searches the segment of `position` from the end, so that the later of two equal knots
  /// counts.
  template <class Knots, class Get>
  static auto curve(const Knots& knots, double position, Get value) {
    for (std::size_t i = knots.size(); i-- > 0;)
      if (knots[i].position <= position) {
        if (i + 1 == knots.size()) return value(knots[i]);
        const double w = (position - knots[i].position) / (knots[i + 1].position - knots[i].position);
        return value(knots[i]) * (1 - w) + value(knots[i + 1]) * w;
      }
    return value(knots[0]);
  }

  glm::dvec4 march(const glm::dvec3& origin, const glm::dvec3& direction, int steps) const {
    double begin = 0, end = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (-0.5 - origin[axis]) / direction[axis];
      const double b = (kDims[axis] - 0.5 - origin[axis]) / direction[axis];
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    const double dt = (end - begin) / steps;
    glm::dvec3 color(0);
    double depth = 0;
    for (int i = 0; i < steps; ++i) {
      const glm::dvec3 p = origin + (begin + (i + 0.5) * dt) * direction;
      double sigma = 0;
      glm::dvec3 emission(0);
      for (std::size_t n = 0; n < scene.channels.size(); ++n) {
        const ChannelAppearance& a = scene.channels[n];
        const double linear = std::clamp((scalarAt(n, p) - a.rangeLo) / (a.rangeHi - a.rangeLo), 0.0, 1.0);
        const double position = std::pow(linear, a.gamma);
        const double s = a.density * curve(a.opacity, position, [](const OpacityKnot& k) { return k.value; });
        sigma += s;
        emission += s * curve(a.color, position, [](const ColorKnot& k) { return k.color; });
      }
      color += std::exp(-depth - 0.5 * sigma * dt) * dt * emission;
      depth += sigma * dt;
    }
    return glm::dvec4(color, -std::expm1(-depth));
  }
};

Volume randomVolume(std::mt19937& random) {
  std::uniform_int_distribution<int> byte(0, 255);
  std::vector<ChannelSource> channels(3);
  for (ChannelSource& channel : channels) {
    Grid grid = gridOf(kDims);
    channel.voxels = VoxelBuffer(ScalarType::u8, grid.voxelCount());
    for (std::uint8_t& v : channel.voxels.as<std::uint8_t>()) v = std::uint8_t(byte(random));
    channel.slope = 0.5;
    channel.intercept = -20;
  }
  return Volume(gridOf(kDims), std::move(channels));
}

ChannelAppearance randomAppearance(std::mt19937& random, bool jumps) {
  std::uniform_real_distribution<double> unit(0, 1);
  ChannelAppearance a;
  a.rangeLo = -20 + 30 * unit(random);
  a.rangeHi = 107 - 30 * unit(random);
  if (unit(random) < 0.3) std::swap(a.rangeLo, a.rangeHi);
  a.gamma = unit(random) < 0.5 ? 1 : 0.4 + 2 * unit(random);
  a.density = 0.2 + 2 * unit(random);
  a.opacity.clear();
  a.color.clear();
  for (int i = 0; i < 5; ++i) a.opacity.push_back({unit(random), unit(random)});
  for (int i = 0; i < 3; ++i) a.color.push_back({unit(random), {unit(random), unit(random), unit(random)}});
  std::sort(a.opacity.begin(), a.opacity.end(), [](auto& x, auto& y) { return x.position < y.position; });
  std::sort(a.color.begin(), a.color.end(), [](auto& x, auto& y) { return x.position < y.position; });
  if (jumps) {
    a.opacity[2].position = a.opacity[1].position;
    a.color[2].position = a.color[1].position;
  }
  return a;
}

void compareOnRandomRays(unsigned seed, bool jumps, double tolerance) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 12; ++trial) {
    const Volume volume = randomVolume(random);
    Scene scene;
    for (int n = 0; n < 3; ++n) scene.channels.push_back(randomAppearance(random, jumps));
    const glm::dvec3 through =
        (glm::dvec3(unit(random), unit(random), unit(random)) * 0.6 + 0.2) * glm::dvec3(kDims - 1);
    const glm::dvec3 direction = glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)) - 0.5);
    const glm::dvec3 origin = through - (trial % 3 ? 10.0 : 0.0) * direction;  // one in three starts inside
    const RayResult found = traceReference(volume, scene, origin, direction);
    const glm::dvec4 expected = Marcher{volume, scene}.march(origin, direction, 200000);
    ASSERT_GT(expected.a, 0.01);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(found.rgba[c], expected[c], tolerance) << "trial " << trial;
    EXPECT_LE(found.error, 2e-7);
  }
}

// A step h is at most 5e-5 long. The marcher's error is h^2 at kinks, h^1.4 at roots (gamma < 1), and h times
// the height at jumps.
TEST(Reference, AgreesWithTinyStepsOnRandomContinuousCurves) { compareOnRandomRays(11, false, 2e-6); }
TEST(Reference, AgreesWithTinyStepsOnRandomCurvesWithJumps) { compareOnRandomRays(12, true, 5e-4); }

}  // namespace
}  // namespace scolopax::reference
