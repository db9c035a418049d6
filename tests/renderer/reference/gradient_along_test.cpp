// SPDX-License-Identifier: Apache-2.0
// Compares the polynomial of the gradient along a ray with the gradient at points.
#include "renderer/reference/gradient_along.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "renderer/reference/ray_cells.h"
#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

void expectSameAsAtPoints(const glm::ivec3& dims, Interpolation interpolation, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const Volume volume = makeVolume(gridOf(dims), {[&](int, int, int) { return unit(random); }});
  const ScalarField field(volume.channels()[0], dims, interpolation);
  const glm::dmat3 toWorld(glm::dvec3(1, 0.2, 0), glm::dvec3(0, 2, 0.1), glm::dvec3(0.3, 0, 0.5));
  for (int ray = 0; ray < 30; ++ray) {
    const glm::dvec3 direction(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
    const glm::dvec3 through = glm::dvec3(unit(random), unit(random), unit(random)) * glm::dvec3(dims) - 0.5;
    const RayCells cells = cutAtCells(
        through, direction, dims, std::numeric_limits<double>::infinity(),
        interpolation == Interpolation::nearest ? CutAt::voxelCentresAndFaces : CutAt::voxelCentres);
    for (std::size_t i = 0; i + 1 < cells.cuts.size(); ++i) {
      const auto at = [&](double u) {
        return cells.origin + std::lerp(cells.cuts[i], cells.cuts[i + 1], u) * cells.direction;
      };
      const auto along = gradientAlong(field, at(0), at(1), toWorld);
      ASSERT_TRUE(along);
      for (const double u : {0.0, 0.01, 0.3, 0.5, 0.77, 1.0}) {
        const glm::dvec3 expected = toWorld * field.gradient(at(u)),
                         found = along->scaled(u) / along->scale(u);
        for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(found[axis], expected[axis], 1e-12);
        for (const glm::dvec3& control : along->scaled.controlPoints())
          ASSERT_LE(glm::length(control), along->scaled.longest() * (1 + 1e-15));
      }
    }
  }
}

TEST(GradientAlong, IsTheGradientInsideAndAtEveryBorder) {
  unsigned seed = 0;
  for (const glm::ivec3 dims : {glm::ivec3(5, 6, 4), glm::ivec3(3), glm::ivec3(2), glm::ivec3(1, 4, 2),
                                glm::ivec3(1, 1, 3), glm::ivec3(2, 3, 1), glm::ivec3(1)})
    for (const Interpolation interpolation :
         {Interpolation::trilinear, Interpolation::cubic, Interpolation::nearest})
      expectSameAsAtPoints(dims, interpolation, ++seed);
}

TEST(GradientAlong, IsNoneWhereADifferenceIsNotFinite) {
  const Volume volume =
      makeVolume(gridOf(glm::ivec3(6, 4, 4)),
                 {[](int i, int, int) { return i == 0 ? std::numeric_limits<double>::quiet_NaN() : i; }});
  const ScalarField field(volume.channels()[0], {6, 4, 4});
  EXPECT_FALSE(
      gradientAlong(field, {1.1, 1, 1}, {1.9, 2, 1.5}, glm::dmat3(1.0)));  // its differences reach x = 0.1
  const auto along = gradientAlong(field, {2.1, 1, 1}, {2.9, 2, 1.5}, glm::dmat3(1.0));
  ASSERT_TRUE(along);
  EXPECT_EQ(along->scaled(0.4) / along->scale(0.4), glm::dvec3(1, 0, 0));
}

TEST(GradientAlong, OfCubicIsNoneWhereACellHasNoValue) {
  const Volume volume =
      makeVolume(gridOf(glm::ivec3(6, 4, 4)),
                 {[](int i, int, int) { return i == 0 ? std::numeric_limits<double>::quiet_NaN() : i; }});
  const ScalarField field(volume.channels()[0], {6, 4, 4}, Interpolation::cubic);
  EXPECT_FALSE(gradientAlong(field, {1.1, 1, 1}, {1.9, 2, 1.5}, glm::dmat3(1.0)));
  const auto along = gradientAlong(field, {2.1, 1, 1}, {2.9, 2, 1.5}, glm::dmat3(1.0));
  ASSERT_TRUE(along);
  EXPECT_EQ(along->scaled(0.4) / along->scale(0.4), glm::dvec3(1, 0, 0));
}

}  // namespace
}  // namespace scolopax::reference
