// SPDX-License-Identifier: Apache-2.0
// Surfaces of the reference: closed forms, and a count of sign changes in small steps.
#include "renderer/reference/surfaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "renderer/core/error.h"
#include "renderer/data/surfaces.h"
#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/test_volumes.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {
namespace {

using namespace test;

/// One row of voxels along x.
Volume row(const std::vector<double>& values) {
  return makeVolume(gridOf({int(values.size()), 1, 1}),
                    {[&](int i, int, int) { return values[std::size_t(i)]; }});
}

void expectSeen(const RayResult& found, const glm::dvec3& color, double alpha) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.rgba[c], color[c], 1e-7) << "component " << c;
  EXPECT_NEAR(found.rgba.a, alpha, 1e-7);
}

TEST(SurfaceList, HasIsovaluesAndPeaks) {
  ChannelAppearance look = ramp(10, 20, 0.5, kRed);
  look.gamma = 2;
  look.color = {{0, kRed}, {1, kBlue}};
  look.opacity = {{0.1, 0}, {0.25, 0.8}, {0.5, 0.1}, {0.7, 0.4}, {0.9, 0.4}, {0.9, 0}};
  look.isovalues = {{15, 0.5, {}}, {12, 1, kGreen}, {13, 0, {}}};
  look.peaks = Peaks::both;
  const auto found = surfacesOf(look, ChannelCurves(look), 2);
  ASSERT_EQ(found.size(), 4u);  // without the one of opacity 0
  EXPECT_EQ(found[0].value, 15);
  EXPECT_EQ(found[0].opacity, 0.5);
  EXPECT_NEAR(found[0].color.x, 0.75, 1e-12);  // at position 0.5^2
  EXPECT_EQ(found[1].color, kGreen);
  EXPECT_NEAR(found[2].value, 15, 1e-12);  // position 0.25 = 0.5^2
  EXPECT_NEAR(found[2].opacity, -std::expm1(-0.8 * 0.5 * 2), 1e-12);
  EXPECT_NEAR(found[2].color.x, 0.75, 1e-12);
  EXPECT_NEAR(found[3].value, 10 + 10 * std::sqrt(0.8), 1e-12);  // the plateau's middle
  EXPECT_NEAR(found[3].opacity, -std::expm1(-0.4), 1e-12);
}

TEST(SurfaceList, HasNoPeaksWhereThereAreNone) {
  const std::vector<std::vector<OpacityKnot>> without{
      {{0, 1}},
      {{0, 0}, {1, 1}},
      {{0, 1}, {1, 0}},
      {{0.2, 1}, {0.5, 0}},                      // constant before its first knot
      {{0.2, 0}, {0.5, 1}},                      // and after its last
      {{0, 0}, {0, 1}, {0.5, 0}},                // at the range's end
      {{0, 0}, {0.5, 0}, {0.5, 1}, {0.5, 0}},    // a knot between two others at its position
      {{0, 0}, {0.3, 0.5}, {0.6, 0.5}, {1, 1}},  // a plateau on the way up
  };
  for (std::size_t i = 0; i < without.size(); ++i) {
    ChannelAppearance look = ramp(0, 1, 1);
    look.opacity = without[i];
    look.peaks = Peaks::only;
    EXPECT_TRUE(surfacesOf(look, ChannelCurves(look), 1).empty()) << i;
    EXPECT_TRUE(peaksOf(without[i]).empty()) << i;
  }
}

TEST(SurfaceList, ThePeaksOfKernelsAreTheSame) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> value(0, 4), step(0, 2), count(1, 9);
  int peaks = 0;
  for (int i = 0; i < 2000; ++i) {
    ChannelAppearance look = ramp(0, 1, 1);
    look.opacity.clear();
    for (int k = count(random), at = 0; k > 0 && at <= 8; --k, at += step(random))
      look.opacity.push_back({at / 8.0, value(random) / 4.0});
    look.peaks = Peaks::only;
    const auto expected = surfacesOf(look, ChannelCurves(look), 1);
    const auto found = peaksOf(look.opacity);
    ASSERT_EQ(found.size(), expected.size()) << i;
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_EQ(found[k].position, expected[k].value) << i;
      EXPECT_NEAR(-std::expm1(-found[k].value), expected[k].opacity, 1e-12) << i;
    }
    peaks += int(found.size());
  }
  EXPECT_GT(peaks, 1000);
}

TEST(ReferenceSurfaces, ARayLosesTheirOpacityInOrder) {
  const Volume volume = row({0, 1, 2, 3, 4, 5});
  const Scene scene = makeScene({surfaces({{3.5, 0.5, kRed}, {1.25, 0.25, kGreen}, {9, 1, kBlue}})});
  expectSeen(alongX(volume, scene), 0.25 * kGreen + 0.75 * 0.5 * kRed, 1 - 0.75 * 0.5);
  expectSeen(traceReference(volume, scene, {15, 0, 0}, {-1, 0, 0}), 0.5 * kRed + 0.5 * 0.25 * kGreen,
             1 - 0.75 * 0.5);
  EXPECT_EQ(traceReference(volume, scene, {2, 0, -5}, {0, 0, 1}).rgba, glm::dvec4(0));  // along the layers
}

TEST(ReferenceSurfaces, APlateauAtTheValueBelongsToTheUpperSide) {
  struct Case {
    std::vector<double> values;
    int crossings;
  };
  const Case cases[] = {{{0, 1, 1, 0}, 2}, {{2, 1, 1, 2}, 0}, {{0, 1, 1, 2}, 1}, {{2, 1, 1, 0}, 1},
                        {{1, 1, 1, 1}, 0}, {{0, 1, 0, 1}, 1}, {{2, 1, 2, 1}, 0}, {{0, 2, 0, 2}, 3},
                        {{1, 0, 0, 1}, 2}, {{0, 0, 1, 2}, 1}};
  for (const Case& c : cases) {
    const double passed = std::pow(0.5, c.crossings);
    expectSeen(alongX(row(c.values), makeScene({surfaces({{1, 0.5, kRed}})})), (1 - passed) * kRed,
               1 - passed);
  }
}

TEST(ReferenceSurfaces, CoincidentOnesAreMetInTheirOrder) {
  const Volume volume =
      makeVolume(gridOf({4, 1, 1}), {[](int i, int, int) { return i; }, [](int i, int, int) { return i; }});
  const Scene scene =
      makeScene({surfaces({{1.5, 0.5, kRed}, {1.5, 0.5, kGreen}}), surfaces({{1.5, 1, kBlue}})});
  for (const BlendMode blend : {BlendMode::density, BlendMode::max, BlendMode::mix}) {
    Scene blended = scene;
    blended.blend = blend;
    expectSeen(alongX(volume, blended), 0.5 * kRed + 0.25 * kGreen + 0.25 * kBlue, 1);
  }
  Scene composite = scene;
  composite.blend = BlendMode::composite;
  expectSeen(alongX(volume, composite), 0.5 * kRed + 0.25 * kGreen + 1.0 * kBlue, 1);
}

TEST(ReferenceSurfaces, AreNotMetAtVoxelsThatAreNotFiniteAndAtClipPlanes) {
  const double bad = std::numeric_limits<double>::quiet_NaN();
  const Scene scene = makeScene({surfaces({{1, 1, kRed}})});
  EXPECT_EQ(alongX(row({0, 0, bad, 2, 2}), scene).rgba.a, 0);
  EXPECT_EQ(alongX(row({0, 0, bad, 2, 2, 0}), scene).rgba.a, 1);
  Scene clipped = makeScene({surfaces({{2.5, 1, kRed}})});
  clipped.clip = {{{3, 0, 0}, {1, 0, 0}, {}}};
  EXPECT_EQ(alongX(row({0, 1, 2, 3, 4}), clipped).rgba.a, 0);  // begins behind the surface
  clipped.clip = {{{2, 0, 0}, {1, 0, 0}, {}}};
  EXPECT_EQ(alongX(row({0, 1, 2, 3, 4}), clipped).rgba.a, 1);
}

TEST(ReferenceSurfaces, MatterIsSeenThroughThem) {
  ChannelAppearance look = solid(0.3, kGreen);
  look.rangeHi = 10;
  look.isovalues = {{2, 0.4, kRed}};
  const double before = std::exp(-0.3 * 2.5), all = std::exp(-0.3 * 6);  // the box begins at -0.5
  expectSeen(alongX(row({0, 1, 2, 3, 4, 5}), makeScene({look})),
             (1 - before) * kGreen + before * 0.4 * kRed + 0.6 * (before - all) * kGreen, 1 - 0.6 * all);
}

TEST(ReferenceSurfaces, OnlyPeaksHaveNoMatter) {
  ChannelAppearance look = ramp(0, 4, 1, kRed);
  look.opacity = {{0, 0}, {0.5, 1}, {1, 0}};
  look.peaks = Peaks::only;
  const double alpha = -std::expm1(-1.0);
  expectSeen(alongX(row({0, 1, 2, 3, 4}), makeScene({look})), alpha * kRed, alpha);
  look.peaks = Peaks::both;
  const Scene both = makeScene({look});
  EXPECT_NEAR(alongX(row({0, 1, 2, 3, 4}), both).rgba.a, 1 - std::exp(-2.0) * (1 - alpha), 1e-7);
}

TEST(ReferenceSurfaces, AreLitInFullHoweverSmallTheGradient) {
  // The gradient is (0.1, 0, 0) over a range of 10: matter would hardly be shaded.
  const Volume volume = makeVolume(gridOf({21, 3, 3}), {[](int i, int, int) { return 0.1 * i; }});
  Scene scene = makeScene({surfaces({{1, 1, kRed}})});
  scene.channels[0].material = {0.1, 0.7, 0.2, 10};
  scene.shading = true;
  const glm::dvec3 direction = glm::normalize(glm::dvec3(0, 3, -4));
  scene.lights = {Light{LightType::directional, direction, kWhite, 2}};
  const glm::dvec3 normal(-1, 0, 0), toViewer(-1, 0, 0);
  const double diffuse = 2 * std::max(0.0, glm::dot(normal, -direction));
  const double highlight = 2 * std::pow(glm::dot(normal, glm::normalize(toViewer - direction)), 10);
  const RayResult found = traceReference(volume, scene, {-5, 1, 1}, {1, 0, 0});
  EXPECT_NEAR(found.rgba.x, 0.1 + 0.7 * diffuse + 0.2 * highlight, 1e-6);
  EXPECT_NEAR(found.rgba.y, 0.2 * highlight, 1e-6);
  EXPECT_EQ(found.rgba.a, 1);
}

TEST(ReferenceSurfaces, CastShadowsButNotOnThemselves) {
  // Light from behind the eye: a surface of opacity 0.4 halfway to a second one, and the eye between them.
  const Volume volume = row({0, 1, 2, 3, 4, 5, 6, 7});
  Scene scene = makeScene({surfaces({{2, 0.4, kRed}, {5, 1, kGreen}})});
  scene.channels[0].material = {0, 1, 0, 1};
  scene.shadows = true;
  scene.lights = {Light{LightType::directional, {1, 0, 0}, kWhite, 1}};
  const RayResult second = traceReference(volume, scene, {3, 0, 0}, {1, 0, 0});
  EXPECT_NEAR(second.rgba.y, 0.6, 1e-6);
  const RayResult both = alongX(volume, scene);
  EXPECT_NEAR(both.rgba.x, 0.4, 1e-6);  // in full light
  EXPECT_NEAR(both.rgba.y, 0.6 * 0.6, 1e-6);
  scene.lights[0].vector = {-1, 0, 0};  // through the second, which is opaque, from behind
  EXPECT_NEAR(alongX(volume, scene).rgba.x, 0, 1e-6);
  EXPECT_NEAR(alongX(volume, scene).rgba.y, 0.6, 1e-6);
}

TEST(ReferenceSurfaces, CrossingsAreThoseThatSmallStepsFind) {
  // Voxels of few different values, so that values lie on isovalues, faces and plateaus.
  std::mt19937 random(11);
  std::uniform_int_distribution<int> value(0, 3);
  std::uniform_real_distribution<double> place(-0.4, 3.4);
  int crossings = 0;
  for (int i = 0; i < 300; ++i) {
    const Volume volume = makeVolume(gridOf({4, 4, 4}), {[&](int, int, int) { return value(random); }});
    const double isovalue = i % 3 == 0 ? 1.0 : i % 3 == 1 ? 1.5 : 2.0;
    const glm::dvec3 from(place(random), place(random), -0.5), to(place(random), place(random), 3.5);
    const ScalarField field(volume.channels()[0], {4, 4, 4});
    constexpr int kSteps = 20011;  // prime: no point lies exactly on a face, where a scalar may just touch
    int expected = 0;
    bool last = field(from) >= isovalue;
    for (int k = 1; k <= kSteps; ++k) {
      const bool inside = field(from + (to - from) * (double(k) / kSteps)) >= isovalue;
      expected += inside != last;
      last = inside;
    }
    const RayResult found =
        traceReference(volume, makeScene({surfaces({{isovalue, 0.5, kRed}})}), from - (to - from), to - from);
    const double counted = -std::log2(1 - found.rgba.a);
    EXPECT_NEAR(counted, expected, 1e-9) << i;
    crossings += expected;
  }
  EXPECT_GT(crossings, 200);
}

TEST(ReferenceSurfaces, RefusesWhatIsNoSurface) {
  const Volume volume = row({0, 1});
  for (const Isovalue& bad : {Isovalue{std::nan(""), 1, {}}, Isovalue{1, 1.5, {}}, Isovalue{1, -0.1, {}}})
    EXPECT_THROW(traceReference(volume, makeScene({surfaces({bad})}), {-5, 0, 0}, {1, 0, 0}), Error);
}

}  // namespace
}  // namespace scolopax::reference
