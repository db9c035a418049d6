// SPDX-License-Identifier: Apache-2.0
// Curves, voxels and coordinates that quadratures and traversals often get wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/test_volumes.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {
namespace {

using namespace test;

double depthAlong(const Volume& volume, const ChannelAppearance& appearance, const glm::dvec3& origin,
                  const glm::dvec3& direction) {
  return depthOf(traceReference(volume, makeScene({appearance}), origin, direction));
}

TEST(ReferenceCurve, NearDiracOpacityIsNeverMissed) {
  const int n = 33;
  const Volume volume = rampAlongX({n, 40, 40});
  for (const double width : {1e-5, 1e-9})
    for (const double centre : {0.371234, 0.5, 0.73, 1.0 / 3}) {
      ChannelAppearance hat = ramp(0, n - 1, 1 / width);
      hat.opacity = {{centre - width / 2, 0}, {centre, 1}, {centre + width / 2, 0}};
      // Area of the hat divided by |df/dt|.
      const double straight = 0.5 * (n - 1);
      const double tolerance = straight * 1e-15 * 4 / width + 1e-10;  // positions are rounded to 1e-16
      EXPECT_NEAR(depthAlong(volume, hat, {-3, 5.2, 7.1}, {1, 0, 0}), straight, tolerance);
      const glm::dvec3 oblique(1, 0.4, -0.3);
      EXPECT_NEAR(depthAlong(volume, hat, glm::dvec3(16, 20, 20) - 30.0 * oblique, oblique),
                  straight * glm::length(oblique), 2 * tolerance);
    }
}

TEST(ReferenceCurve, StepsAndBoxesCutAtTheirPlace) {
  const int n = 11;
  const Volume volume = rampAlongX({n, 1, 1});
  ChannelAppearance appearance = ramp(0, n - 1, 0.3);
  appearance.opacity = {{0, 0}, {0.437, 0}, {0.437, 1}, {1, 1}};
  EXPECT_NEAR(depthAlong(volume, appearance, {-3, 0, 0}, {1, 0, 0}), 0.3 * (0.563 * 10 + 0.5), 1e-12);
  appearance.opacity = {{0.3, 0}, {0.3, 1}, {0.4, 1}, {0.4, 0}};
  EXPECT_NEAR(depthAlong(volume, appearance, {-3, 0, 0}, {1, 0, 0}), 0.3, 1e-12);
}

TEST(ReferenceCurve, AStepInColorSplitsTheLightAtItsPlace) {
  const int n = 11;
  const Volume volume = rampAlongX({n, 1, 1});
  ChannelAppearance appearance = solid(0.3, kRed);
  appearance.rangeHi = n - 1;
  appearance.color = {{0, {1, 0, 0}}, {0.25, {1, 0, 0}}, {0.25, {0, 0, 1}}};
  const RayResult found = traceReference(volume, makeScene({appearance}), {-3, 0, 0}, {1, 0, 0});
  const double front = 1 - std::exp(-0.3 * 3);  // half a voxel and 2.5
  EXPECT_NEAR(found.rgba.r, front, 1e-12);
  EXPECT_NEAR(found.rgba.b, (1 - front) * (1 - std::exp(-0.3 * 8)), 1e-12);
}

TEST(ReferenceCurve, AReversedRangeReverses) {
  const int n = 7;
  const Volume volume = rampAlongX({n, 1, 1});
  const Scene forward = makeScene({ramp(0, n - 1, 0.4, kRed)}),
              backward = makeScene({ramp(n - 1, 0, 0.4, kRed)});
  EXPECT_NEAR(traceReference(volume, forward, {-3, 0, 0}, {1, 0, 0}).rgba.r,
              traceReference(volume, backward, {n + 3, 0, 0}, {-1, 0, 0}).rgba.r, 1e-12);
  ChannelAppearance colors = solid(0.4, kRed);
  colors.rangeLo = n - 1;
  colors.rangeHi = 0;
  colors.color = {{0, {1, 0, 0}}, {0.5, {1, 0, 0}}, {0.5, {0, 0, 1}}};
  const RayResult found = traceReference(volume, makeScene({colors}), {-3, 0, 0}, {1, 0, 0});
  EXPECT_NEAR(found.rgba.b, 1 - std::exp(-0.4 * 3.5), 1e-12);  // low values have high positions
}

TEST(ReferenceCurve, AnEmptyRangeIsAStep) {
  const int n = 7;
  EXPECT_NEAR(depthAlong(rampAlongX({n, 1, 1}), ramp(2.25, 2.25, 0.4), {-3, 0, 0}, {1, 0, 0}),
              0.4 * (6.5 - 2.25), 1e-12);
  // A volume in which every voxel has exactly the value of the step is above it.
  const Volume constant = makeVolume(gridOf({3, 4, 5}), {[](int, int, int) { return 0.1f; }});
  const double value = double(0.1f);
  EXPECT_NEAR(depthAlong(constant, ramp(value, value, 0.4), {-3, 1.3, 2.2}, {1, 0.1, 0.2}),
              0.4 * 3 * std::sqrt(1.05), 1e-12);
  EXPECT_EQ(depthAlong(constant, ramp(value + 1e-9, value + 1e-9, 0.4), {-3, 1.3, 2.2}, {1, 0, 0}), 0);
}

TEST(ReferenceCurve, GammaBendsTheRamp) {
  const int n = 9;
  const Volume volume = rampAlongX({n, 1, 1});
  for (const double gamma : {0.1, 0.5, 1.7, 2.0, 5.0}) {
    ChannelAppearance appearance = ramp(0, n - 1, 0.2);
    appearance.gamma = gamma;
    EXPECT_NEAR(depthAlong(volume, appearance, {-3, 0, 0}, {1, 0, 0}), 0.2 * (8 / (gamma + 1) + 0.5), 1e-8)
        << gamma;
    appearance.density = 1e-7;
    EXPECT_NEAR(depthAlong(volume, appearance, {-3, 0, 0}, {1, 0, 0}) / (1e-7 * (8 / (gamma + 1) + 0.5)), 1,
                1e-6);
  }
}

TEST(ReferenceVoxels, ThatAreNotFiniteEmptyTheCellsTheyBelongTo) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    const VoxelFunction holed = [&](int i, int, int) { return i == 2 ? bad : 1.0; };
    const Volume volume = makeVolume(gridOf({6, 1, 1}), {holed, [](int, int, int) { return 1; }});
    Scene scene = makeScene({solid(0.5, kRed), solid(0.25, {0, 1, 0})});
    EXPECT_NEAR(-std::log1p(-traceReference(volume, scene, {-3, 0, 0}, {1, 0, 0}).rgba.a), 0.5 * 4 + 0.25 * 6,
                1e-12);
    scene.channels[1].visible = false;
    EXPECT_NEAR(-std::log1p(-traceReference(volume, scene, {-3, 0, 0}, {1, 0, 0}).rgba.a), 0.5 * 4, 1e-12);
  }
}

TEST(ReferenceVoxels, ThatAreNotFiniteCountWithWeightZeroInTheCellOfTheSample) {
  const auto depthAt = [&](int badRow, double y) {
    const Volume volume = makeVolume(gridOf({5, 5, 1}),
                                     {[&](int i, int j, int) { return i == 2 && j == badRow ? kNaN : 1.0; }});
    return depthAlong(volume, solid(1, kRed), {-3, y, 0}, {1, 0, 0});
  };
  EXPECT_NEAR(depthAt(1, 0), 3, 1e-12);  // row 0 is in the cells [0,1), whose corners include row 1
  EXPECT_NEAR(depthAt(1, 1), 3, 1e-12);
  EXPECT_NEAR(depthAt(1, 1.99), 3, 1e-12);
  EXPECT_NEAR(depthAt(1, 2), 5, 1e-12);      // cells [2,3)
  EXPECT_NEAR(depthAt(1, -0.25), 3, 1e-12);  // the outer half voxels belong to the outermost cells
  EXPECT_NEAR(depthAt(3, 4.25), 3, 1e-12);
  EXPECT_NEAR(depthAt(3, 2), 3, 1e-12);
  EXPECT_NEAR(depthAt(3, 1.99), 5, 1e-12);
}

TEST(ReferenceVoxels, ThatAreNotFiniteBesideTheEdgeEmptyTheOuterHalfVoxel) {
  const Volume volume = makeVolume(gridOf({6, 1, 1}), {[](int i, int, int) { return i == 1 ? kNaN : 1.0; }});
  EXPECT_NEAR(depthAlong(volume, solid(1, kRed), {-3, 0, 0}, {1, 0, 0}), 3.5, 1e-12);
}

TEST(ReferenceVoxels, WithoutAFiniteOneNothingIsSeen) {
  const Volume volume = makeVolume(gridOf({3, 3, 3}), {[](int, int, int) { return kNaN; }});
  EXPECT_EQ(traceReference(volume, makeScene({solid(5, kRed)}), {-3, 1, 1}, {1, 0, 0}).rgba, glm::dvec4(0));
}

TEST(ReferenceVoxels, OfExtremeSizeInterpolateWithoutOverflow) {
  const double huge = std::numeric_limits<float>::max();
  const Volume volume = makeVolume(gridOf({2, 1, 1}), {[&](int i, int, int) { return i ? huge : -huge; }});
  EXPECT_NEAR(depthAlong(volume, ramp(-huge, huge, 0.5), {-3, 0, 0}, {1, 0, 0}), 0.5 * (0.5 + 0.5), 1e-12);
  const double tiny = std::numeric_limits<float>::denorm_min();
  const Volume small = makeVolume(gridOf({2, 1, 1}), {[&](int i, int, int) { return i * tiny; }});
  EXPECT_NEAR(depthAlong(small, ramp(0, tiny, 0.5), {-3, 0, 0}, {1, 0, 0}), 0.5 * (0.5 + 0.5), 1e-12);
}

TEST(ReferenceVoxels, ASingleOneIsABoxOfItsOwn) {
  const Volume volume =
      makeVolume(gridOf({1, 1, 1}, {2, 3, 4}, {10, 20, 30}), {[](int, int, int) { return 7; }});
  EXPECT_NEAR(depthAlong(volume, solid(0.1, kRed), {0, 20, 30}, {1, 0, 0}), 0.2, 1e-12);
  EXPECT_NEAR(depthAlong(volume, solid(0.1, kRed), {10, 0, 30}, {0, 1, 0}), 0.3, 1e-12);
  EXPECT_NEAR(depthAlong(volume, solid(0.1, kRed), {10, 20, 99}, {0, 0, -1}), 0.4, 1e-12);
}

TEST(ReferenceVoxels, OfZeroAreExactlyTransparent) {
  const Volume volume = makeVolume(gridOf({4, 4, 4}), {[](int, int, int) { return 0; }});
  EXPECT_EQ(traceReference(volume, makeScene({ramp(0, 1, 1e6)}), {-3, 1.5, 1.5}, {1, 0.1, 0}).rgba,
            glm::dvec4(0));
}

TEST(ReferenceVoxels, OfIntegerTypesBecomeDataBySlopeAndIntercept) {
  std::vector<ChannelSource> channels(1);
  channels[0].voxels = VoxelBuffer(ScalarType::i16, 3);
  const auto stored = channels[0].voxels.as<std::int16_t>();
  stored[0] = -100, stored[1] = 0, stored[2] = 100;
  channels[0].slope = 0.01;
  channels[0].intercept = 300;  // 299, 300, 301
  const Volume volume(gridOf({3, 1, 1}), std::move(channels));
  EXPECT_NEAR(depthAlong(volume, ramp(299, 301, 0.5), {-3, 0, 0}, {1, 0, 0}), 0.5 * (1 + 0.5), 1e-12);
}

/// A lumpy field, traced along rays that are given in voxel coordinates and mapped to a world space.
struct Mapped {
  glm::dmat4 worldFromVoxel{1.0};
  double density = 0.6;
  RayResult trace(const glm::dvec3& originVoxel, const glm::dvec3& directionVoxel) const {
    Grid grid;
    grid.dims = {7, 6, 5};
    grid.worldFromVoxel = worldFromVoxel;
    const Volume volume =
        makeVolume(grid, {[](int i, int j, int k) { return std::sin(1.3 * i) + std::cos(2.1 * j + k); }});
    Scene scene = makeScene({ramp(-2, 2, density)});
    scene.channels[0].color = {{0, {1, 0, 0}}, {0.4, {0, 1, 0}}, {1, {0, 0, 1}}};
    return traceReference(volume, scene, glm::dvec3(worldFromVoxel * glm::dvec4(originVoxel, 1)),
                          glm::dvec3(worldFromVoxel * glm::dvec4(directionVoxel, 0)));
  }
};

const glm::dvec3 kOrigin(-6, -5, -3), kDirection(1, 0.9, 0.7);

void expectSame(const RayResult& a, const RayResult& b, double tolerance) {
  ASSERT_GT(b.rgba.a, 0.1);
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(a.rgba[c], b.rgba[c], tolerance) << "component " << c;
}

TEST(ReferenceWorld, ScaledByABillionthOrABillionLooksTheSame) {
  const RayResult plain = Mapped{}.trace(kOrigin, kDirection);
  for (const double scale : {1e-9, 1e9}) {
    Mapped mapped{glm::dmat4(scale), 0.6 / scale};
    mapped.worldFromVoxel[3][3] = 1;
    expectSame(mapped.trace(kOrigin, kDirection), plain, 1e-9);
  }
}

TEST(ReferenceWorld, OffsetByAMillionLooksTheSame) {
  Mapped mapped;
  mapped.worldFromVoxel[3] = {1e6, -1e6, 1e6, 1};
  expectSame(mapped.trace(kOrigin, kDirection), Mapped{}.trace(kOrigin, kDirection), 1e-8);
}

TEST(ReferenceWorld, SeenFromAMillionAwayLooksTheSame) {
  expectSame(Mapped{}.trace(kOrigin - 1e6 * kDirection, kDirection), Mapped{}.trace(kOrigin, kDirection),
             1e-8);
}

TEST(ReferenceWorld, RotatedAndMirroredLooksTheSame) {
  Mapped mapped;
  const double c = std::cos(0.4), s = std::sin(0.4);
  mapped.worldFromVoxel[0] = {-c, -s, 0, 0};
  mapped.worldFromVoxel[1] = {0, 0, 1, 0};
  mapped.worldFromVoxel[2] = {s, -c, 0, 0};
  mapped.worldFromVoxel[3] = {3, -8, 1, 1};
  expectSame(mapped.trace(kOrigin, kDirection), Mapped{}.trace(kOrigin, kDirection), 1e-9);
  // Along a face and along an axis, where rounding produces components that are almost 0.
  expectSame(mapped.trace({-6, -0.5, 2}, {1, 0, 0}), Mapped{}.trace({-6, -0.5, 2}, {1, 0, 0}), 1e-9);
}

TEST(ReferenceWorld, AnisotropicSpacingOfOneToAHundredStretchesLengths) {
  const Volume volume = makeVolume(gridOf({5, 5, 5}, {1, 1, 100}), {[](int, int, int k) { return k; }});
  EXPECT_NEAR(depthAlong(volume, ramp(0, 4, 0.01), {2, 2, -300}, {0, 0, 1}), 0.01 * (200 + 50), 1e-12);
  // Across all layers obliquely: z decreases by 100 when x changes by 1.
  const double length = std::sqrt(1 + 1e4);
  EXPECT_NEAR(depthAlong(volume, ramp(0, 4, 0.01), {-0.5, 2, 450}, {1, 0, -100}), 0.01 * length * (2 + 0.5),
              1e-11);
}

}  // namespace
}  // namespace scolopax::reference
