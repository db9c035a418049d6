// SPDX-License-Identifier: Apache-2.0
#include "renderer/generate/orbitals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "renderer/core/error.h"

namespace scolopax {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Composite Simpson rule with an even number of intervals.
template <class F>
double simpson(double a, double b, int intervals, F&& f) {
  const double h = (b - a) / intervals;
  double sum = f(a) + f(b);
  for (int i = 1; i < intervals; ++i) sum += (i % 2 ? 4 : 2) * f(a + i * h);
  return sum * h / 3;
}

double integralOverSpace(const HydrogenOrbital& orbital, int n) {
  return simpson(0, 50.0 * n, 8000, [&](double r) {
    const double shell = simpson(-1, 1, 400, [&](double cosine) {
      return orbital.density({r * std::sqrt(1 - cosine * cosine), 0, r * cosine});
    });
    return 2 * kPi * r * r * shell;
  });
}

glm::dvec3 finiteDifferences(const HydrogenOrbital& orbital, const glm::dvec3& p) {
  constexpr double h = 2e-3;  // fourth order: an error near h^4 and 1e-16 / h
  glm::dvec3 result;
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 step(0);
    step[axis] = h;
    result[axis] = (8 * (orbital.density(p + step) - orbital.density(p - step)) -
                    (orbital.density(p + 2.0 * step) - orbital.density(p - 2.0 * step))) /
                   (12 * h);
  }
  return result;
}

TEST(HydrogenOrbital, IntegratesToOneForEveryStateUpToN4) {
  for (int n = 1; n <= 4; ++n)
    for (int l = 0; l < n; ++l)
      for (int m = 0; m <= l; ++m) EXPECT_NEAR(integralOverSpace({n, l, m}, n), 1, 1e-7) << n << l << m;
}

TEST(HydrogenOrbital, IntegratesToOneForTheHighestStates) {
  EXPECT_NEAR(integralOverSpace({10, 9, 4}, 10), 1, 1e-7);
  EXPECT_NEAR(integralOverSpace({10, 2, 1}, 10), 1, 1e-7);
}

TEST(HydrogenOrbital, HasTheTextbookValues) {
  const glm::dvec3 p(1.0, -2.0, 2.0);  // r = 3, cos = 2/3, sin^2 = 5/9
  EXPECT_NEAR(HydrogenOrbital(1, 0, 0).density({0, 0, 0}), 1 / kPi, 1e-15);
  EXPECT_NEAR(HydrogenOrbital(2, 0, 0).density(p), std::exp(-3.0) / (32 * kPi), 1e-16);      // (2 - r)^2 = 1
  EXPECT_NEAR(HydrogenOrbital(2, 1, 0).density(p), 4 * std::exp(-3.0) / (32 * kPi), 1e-16);  // z^2
  EXPECT_NEAR(HydrogenOrbital(2, 1, 1).density(p), 5 * std::exp(-3.0) / (64 * kPi), 1e-16);  // x^2 + y^2
  EXPECT_NEAR(HydrogenOrbital(3, 2, 2).density(p), 25 * std::exp(-2.0) / (162. * 162. * kPi), 1e-16);
  EXPECT_NEAR(HydrogenOrbital(3, 2, 0).density(p), 9 * std::exp(-2.0) / (81. * 81. * 6 * kPi),
              1e-16);  // 3z^2 - r^2 = 3
}

TEST(HydrogenOrbital, DependsOnTheSizeOfMAlone) {
  EXPECT_EQ(HydrogenOrbital(4, 3, -2).density({1, 2, 3}), HydrogenOrbital(4, 3, 2).density({1, 2, 3}));
}

TEST(HydrogenOrbital, SummedOverMIsTheSameInAllDirections) {
  for (int l = 0; l <= 4; ++l) {
    const auto shell = [&](const glm::dvec3& p) {
      double sum = 0;
      for (int m = -l; m <= l; ++m) sum += HydrogenOrbital(5, l, m).density(p);
      return sum;
    };
    const double expected = shell({0, 0, 7});
    EXPECT_NEAR(shell({7, 0, 0}) / expected, 1, 1e-12);
    EXPECT_NEAR(shell({2, -3, 6}) / expected, 1, 1e-12);
  }
}

TEST(HydrogenOrbital, GradientAgreesWithFiniteDifferencesAtRandomPoints) {
  std::mt19937 random(20240501);
  std::uniform_real_distribution<double> coordinate(-12, 12);
  for (int i = 0; i < kMaxOrbitals; ++i) {
    const HydrogenOrbital orbital = demoOrbital(i);
    for (int trial = 0; trial < 50; ++trial) {
      const glm::dvec3 p(coordinate(random), coordinate(random), coordinate(random));
      const glm::dvec3 expected = finiteDifferences(orbital, p), found = orbital.gradient(p);
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(found[axis], expected[axis], 1e-13) << orbital.name();
    }
  }
}

TEST(HydrogenOrbital, GradientIsRightOnTheAxisAndInThePlaneThroughTheNucleus) {
  for (int n = 2; n <= 5; ++n)
    for (int l = 0; l < n; ++l)
      for (int m = 0; m <= l; ++m)
        for (const glm::dvec3 p : {glm::dvec3(0, 0, 1.5), glm::dvec3(0, 0, -4), glm::dvec3(2.5, 0, 0),
                                   glm::dvec3(0, -1.25, 0), glm::dvec3(1, 1, 0)}) {
          const HydrogenOrbital orbital(n, l, m);
          const glm::dvec3 expected = finiteDifferences(orbital, p), found = orbital.gradient(p);
          for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(found[axis], expected[axis], 1e-11) << orbital.name() << " axis " << axis;
        }
}

TEST(HydrogenOrbital, GradientVanishesAtTheOrigin) {
  for (int n = 1; n <= 5; ++n)
    for (int l = 0; l < n; ++l)
      for (int m = 0; m <= l; ++m) {
        const glm::dvec3 found = HydrogenOrbital(n, l, m).gradient({0, 0, 0});
        EXPECT_EQ(found, glm::dvec3(0)) << n << l << m;
      }
}

TEST(HydrogenOrbital, GroundStateHasItsCuspBesideTheOrigin) {
  const glm::dvec3 found = HydrogenOrbital(1, 0, 0).gradient({1e-9, 0, 0});  // d/dr e^(-2r)/pi
  EXPECT_NEAR(found.x, -2 / kPi, 1e-8);
  EXPECT_EQ(found.y, 0);
}

TEST(HydrogenOrbital, NamesItself) { EXPECT_EQ(HydrogenOrbital(3, 2, -1).name(), "3d m=1"); }

TEST(HydrogenOrbital, RefusesNumbersThatAreNoState) {
  EXPECT_THROW(HydrogenOrbital(0, 0, 0), Error);
  EXPECT_THROW(HydrogenOrbital(3, 3, 0), Error);
  EXPECT_THROW(HydrogenOrbital(3, -1, 0), Error);
  EXPECT_THROW(HydrogenOrbital(3, 2, -3), Error);
  EXPECT_THROW(HydrogenOrbital(11, 0, 0), Error);
}

TEST(Orbitals, StoreTheDensityOfEveryVoxelWithinHalfAStep) {
  const int size = 15;
  const GeneratedVolume volume = generateOrbitals(size, kMaxOrbitals);
  ASSERT_EQ(volume.channels.size(), std::size_t(kMaxOrbitals));
  for (int c = 0; c < kMaxOrbitals; ++c) {
    const ChannelSource& channel = volume.channels[std::size_t(c)];
    const auto voxels = channel.voxels.as<const std::uint16_t>();
    ASSERT_EQ(voxels.size(), std::size_t(size) * size * size);
    EXPECT_EQ(*std::max_element(voxels.begin(), voxels.end()), 65535);
    EXPECT_EQ(channel.intercept, 0);
    EXPECT_EQ(channel.unit, "a0^-3");
    for (int k = 0; k < size; ++k)
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) {
          const glm::dvec3 p(volume.grid.worldFromVoxel * glm::dvec4(i, j, k, 1));
          const double stored = voxels[std::size_t((k * size + j) * size + i)];
          ASSERT_NEAR(stored * channel.slope, demoOrbital(c).density(p), 0.5001 * channel.slope);
        }
  }
}

TEST(Orbitals, FillACubeCentredAtTheNucleusWhateverTheSize) {
  for (const int size : {2, 7, 64}) {
    const Grid grid = generateOrbitals(size, 1).grid;
    EXPECT_EQ(grid.dims, glm::ivec3(size));
    const glm::dvec3 low(grid.worldFromVoxel * glm::dvec4(glm::dvec3(-0.5), 1));
    const glm::dvec3 high(grid.worldFromVoxel * glm::dvec4(glm::dvec3(size - 0.5), 1));
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(low[axis], -kOrbitalBoxHalfEdge, 1e-12);
      EXPECT_NEAR(high[axis], kOrbitalBoxHalfEdge, 1e-12);
    }
  }
}

TEST(Orbitals, HoldAllButAHundredthOfTheProbabilityInTheBox) {
  const GeneratedVolume volume = generateOrbitals(64, kMaxOrbitals);
  const double cell = std::pow(2 * kOrbitalBoxHalfEdge / 64, 3);
  for (const ChannelSource& channel : volume.channels) {
    const auto voxels = channel.voxels.as<const std::uint16_t>();
    const double sum = std::accumulate(voxels.begin(), voxels.end(), 0.0) * channel.slope * cell;
    EXPECT_NEAR(sum, 1, 0.01) << channel.name;
  }
}

TEST(Orbitals, AreDistinctAndFourOfThemOn128CubedByDefault) {
  const GeneratedVolume volume = generateOrbitals();
  EXPECT_EQ(volume.grid.dims, glm::ivec3(128));
  EXPECT_EQ(volume.channels.size(), 4u);
  std::set<std::string> names;
  for (int i = 0; i < kMaxOrbitals; ++i) names.insert(demoOrbital(i).name());
  EXPECT_EQ(names.size(), std::size_t(kMaxOrbitals));
}

TEST(Orbitals, KeepASlopeWhenEveryVoxelLiesOnANodalSurface) {
  // The centres of 2^3 voxels lie on the diagonals of the cube, where 3d m=0 is 0.
  const GeneratedVolume volume = generateOrbitals(2, 4);
  ASSERT_EQ(volume.channels[3].name, "3d m=0");
  EXPECT_GT(volume.channels[3].slope, 0);
}

TEST(Orbitals, RefuseSizesAndChannelCountsOutOfRange) {
  EXPECT_THROW(generateOrbitals(1, 1), Error);
  EXPECT_THROW(generateOrbitals(1025, 1), Error);
  EXPECT_THROW(generateOrbitals(8, 0), Error);
  EXPECT_THROW(generateOrbitals(8, kMaxOrbitals + 1), Error);
}

}  // namespace
}  // namespace scolopax
