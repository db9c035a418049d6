// SPDX-License-Identifier: Apache-2.0
// Scalars along rays through random volumes, for every interpolation, against the scalar at points.
#include "renderer/reference/scalar_along.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

/// A volume of random voxels, and rays through it that are cut at all planes.
struct Rays {
  std::mt19937 random;
  glm::ivec3 dims;
  Volume volume;
  Rays(unsigned seed, const glm::ivec3& size)
      : random(seed),
        dims(size),
        volume(makeVolume(gridOf(size), {[this](int, int, int) { return 280 + 30 * unit(); }})) {}
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
  ScalarField field(Interpolation interpolation) const { return {volume.channels()[0], dims, interpolation}; }
  /// Calls visit(scalar, point) for every part of a ray, where point(u) is in voxel coordinates.
  template <class Visit>
  void forEachPart(Interpolation interpolation, int rays, const Visit& visit) {
    for (int ray = 0; ray < rays; ++ray) {
      const glm::dvec3 direction(unit() - 0.5, unit() - 0.5, unit() - 0.5);
      const glm::dvec3 through = glm::dvec3(unit(), unit(), unit()) * glm::dvec3(dims) - 0.5;
      const RayCells cells = cutAtCells(through, direction, dims, std::numeric_limits<double>::infinity(),
                                        CutAt::voxelCentresAndFaces);
      for (std::size_t i = 0; i + 1 < cells.cuts.size(); ++i) {
        const double begin = cells.cuts[i], end = cells.cuts[i + 1];
        const auto scalar = scalarAlong(field(interpolation), CellOnRay(cells, begin, end, dims));
        ASSERT_TRUE(scalar);
        visit(*scalar, [&](double u) { return cells.origin + std::lerp(begin, end, u) * cells.direction; });
      }
    }
  }
};

TEST(ScalarAlong, IsTheScalarAtEveryPoint) {
  for (const Interpolation interpolation : kInterpolations)
    for (const glm::ivec3 dims : {glm::ivec3(5, 6, 4), glm::ivec3(2), glm::ivec3(1, 4, 2), glm::ivec3(1)}) {
      Rays rays(1, dims);
      const ScalarField field = rays.field(interpolation);
      rays.forEachPart(interpolation, 30, [&](const ScalarAlong& scalar, const auto& point) {
        for (int k = 0; k < 5; ++k) {
          const double u = rays.unit(), expected = field(point(u));
          EXPECT_NEAR(scalar(u), expected, 1e-12 * expected) << nameOf(interpolation);
          EXPECT_LE(scalar.lower(), scalar(u) * (1 + 1e-15));
          EXPECT_GE(scalar.upper(), scalar(u) * (1 - 1e-15));
        }
      });
    }
}

TEST(ScalarAlong, OfNearestIsExactlyOneVoxel) {
  Rays rays(2, {4, 3, 5});
  const auto voxels = rays.volume.channels()[0].voxels.as<float>();
  rays.forEachPart(Interpolation::nearest, 50, [&](const ScalarAlong& scalar, const auto& point) {
    const glm::ivec3 v = glm::clamp(glm::ivec3(glm::floor(point(0.5) + 0.5)), glm::ivec3(0), rays.dims - 1);
    const double expected = double(voxels[std::size_t(v.x + 4 * (v.y + 3 * v.z))]);
    for (const double u : {0.0, 0.1, 0.77, 1.0}) EXPECT_EQ(scalar(u), expected);
    EXPECT_EQ(scalar.lower(), expected);
    EXPECT_EQ(scalar.upper(), expected);
    std::vector<double> crossings;
    scalar.appendCrossings(expected, crossings);
    EXPECT_TRUE(crossings.empty());
  });
}

TEST(ScalarAlong, FindsEveryCrossingThatAFineScanSees) {
  Rays rays(3, {5, 4, 4});
  int found = 0;
  rays.forEachPart(Interpolation::cubic, 200, [&](const ScalarAlong& scalar, const auto&) {
    for (const double value : {290.0, 295.0, 300.0}) {
      std::vector<double> crossings;
      scalar.appendCrossings(value, crossings);
      found += int(crossings.size());
      EXPECT_TRUE(std::is_sorted(crossings.begin(), crossings.end()));
      for (const double u : crossings) {
        EXPECT_TRUE(u > 0 && u < 1);
        EXPECT_NEAR(scalar(u), value, 1e-12 * value);
      }
      constexpr int kSteps = 500;
      for (int i = 0; i < kSteps; ++i) {
        const double a = double(i) / kSteps, b = double(i + 1) / kSteps;
        if ((scalar(a) < value) == (scalar(b) < value)) continue;
        EXPECT_TRUE(std::any_of(crossings.begin(), crossings.end(),
                                [&](double u) { return u >= a - 1e-12 && u <= b + 1e-12; }));
      }
    }
  });
  EXPECT_GT(found, 100);
}

/// The scalar along the row of these voxels, in its cell `cell`.
ScalarAlong cubicAlong(const std::vector<double>& row, int cell) {
  const glm::ivec3 dims(int(row.size()), 1, 1);
  const Volume volume = makeVolume(gridOf(dims), {[&](int i, int, int) { return row[std::size_t(i)]; }});
  RayCells ray = cutAtCells({-9, 0, 0}, {1, 0, 0}, dims);
  return *scalarAlong({volume.channels()[0], dims, Interpolation::cubic},
                      CellOnRay(ray, ray.cuts[std::size_t(cell) + 1], ray.cuts[std::size_t(cell) + 2], dims));
}

TEST(ScalarAlong, CrossingsAreExactToTheLastBit) {
  // In cell [1, 2] the scalar is t^3 / 6.
  for (const double t : {1e-3, 0.1, 0.3, 0.77, 0.999}) {
    std::vector<double> crossings;
    cubicAlong({0, 0, 0, 1}, 1).appendCrossings(t * t * t / 6, crossings);
    ASSERT_EQ(crossings.size(), 1u);
    // Coefficients up to 1/6 are rounded by 1e-17, at a slope of t^2 / 2.
    EXPECT_NEAR(crossings[0], t, 4e-16 + 1e-16 / (t * t));
  }
}

TEST(ScalarAlong, TouchesAValueWithoutCrossingIt) {
  // In the middle of the cell the scalar is smallest: 1/48 of the outer voxels.
  const ScalarAlong scalar = cubicAlong({1, 0, 0, 1}, 1);
  EXPECT_NEAR(scalar(0.5), 1.0 / 24, 1e-17);
  std::vector<double> crossings;
  scalar.appendCrossings(1.0 / 24 - 1e-12, crossings);
  EXPECT_TRUE(crossings.empty());
  scalar.appendCrossings(1.0 / 24 + 1e-12, crossings);
  ASSERT_EQ(crossings.size(), 2u);  // the second derivative is 1
  EXPECT_NEAR(crossings[0], 0.5 - std::sqrt(2e-12), 1e-9);
  EXPECT_NEAR(crossings[1], 0.5 + std::sqrt(2e-12), 1e-9);
}

TEST(ScalarAlong, OfNearestAlongAFaceIsThatOfTheLaterVoxelWithinRounding) {
  const glm::ivec3 dims(4, 3, 1);
  const Volume volume = makeVolume(gridOf(dims), {[](int i, int j, int) { return i + 10 * j; }});
  const ScalarField field(volume.channels()[0], dims, Interpolation::nearest);
  for (const double y : {0.5, 0.5 - 1e-15, 0.5 + 1e-15}) {
    const RayCells ray = cutAtCells({-9, y, 0}, {1, 0, 0}, dims, 99, CutAt::voxelCentresAndFaces);
    for (std::size_t i = 0; i + 1 < ray.cuts.size(); ++i) {
      const CellOnRay part(ray, ray.cuts[i], ray.cuts[i + 1], dims);
      EXPECT_EQ((*scalarAlong(field, part))(0.5), std::floor(part.middle.x + 0.5) + 10);
    }
  }
}

}  // namespace
}  // namespace scolopax::reference
