// SPDX-License-Identifier: Apache-2.0
// Opacity by the gradient along rays on which |gradient| has a closed form, and the cuts that integration
// needs.
#include "renderer/reference/gradient_factor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "renderer/core/error.h"
#include "renderer/reference/integrator.h"
#include "tests/renderer/reference/random_light.h"
#include "tests/support/gradients.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {
namespace {

using namespace test;

/// A channel with extinction `density` times the factor.
ChannelAppearance factored(double density, GradientOpacity opacity, glm::dvec3 color = kRed) {
  ChannelAppearance appearance = solid(density, color);
  appearance.gradientOpacity = std::move(opacity);
  return appearance;
}
GradientOpacity step(double at) { return {at, at, {{0, 0}, {1, 1}}}; }

RayResult alongRow(const Volume& volume, const std::vector<ChannelAppearance>& channels,
                   BlendMode blend = BlendMode::density) {
  Scene scene = makeScene(channels);
  scene.blend = blend;
  return traceReference(volume, scene, {-3, 0, 0}, {1, 0, 0});
}

/// Voxel i of `count` is i^2. |gradient| is 2x from the second voxel to the last but one, (1 + 3x) / (1 + x)
/// before, and constant in the outer half voxels; for a `count` of 12 it is (40 - 19w) / (2 - w) after, with
/// w = x - 10.
Volume squares(int count = 12, std::size_t channels = 1) {
  const VoxelFunction square = [](int i, int, int) { return i * i; };
  return makeVolume(gridOf({count, 1, 1}), std::vector<VoxelFunction>(channels, square));
}

/// A linear field on a grid that is neither orthogonal nor isotropic; floats represent all voxels exactly.
struct Linear {
  glm::dvec3 gradient{1.5, -0.5, 2};
  Grid grid = gridOf({5, 6, 4});
  Volume volume;
  Linear() : volume(make()) {}
  Volume make() {
    const glm::dmat3 axes(glm::dvec3(1, 0.25, 0), glm::dvec3(0.125, 2, 0.5), glm::dvec3(0, 0, 0.75));
    grid.worldFromVoxel = glm::dmat4(axes);
    grid.worldFromVoxel[3] = glm::dvec4(3, -2, 1, 1);
    return makeVolume(
        grid, {[=, this](int i, int j, int k) { return glm::dot(gradient, axes * glm::dvec3(i, j, k)); }});
  }
};

TEST(ReferenceGradientOpacity, OfALinearFieldIsOneFactor) {
  const Linear linear;
  const double steepness = glm::length(linear.gradient);
  const glm::dvec3 centre(linear.grid.worldFromVoxel * glm::dvec4(2, 2.5, 1.5, 1));
  for (const bool lit : {false, true}) {
    Scene scene = makeScene({factored(0.7, {0, 2 * steepness, {{0, 0}, {1, 1}}})});
    scene.shading = scene.shadows = lit;
    scene.channels[0].rangeHi = 8;
    Scene half = scene;
    half.channels[0].density = 0.35;
    half.channels[0].gradientOpacity.reset();
    RandomLight draw(3);
    for (int ray = 0; ray < (lit ? 4 : 40); ++ray) {
      const glm::dvec3 direction = glm::normalize(draw.vector());
      const glm::dvec3 origin = centre + 0.7 * draw.vector() - 20.0 * direction;
      const RayResult found = traceReference(linear.volume, scene, origin, direction),
                      expected = traceReference(linear.volume, half, origin, direction);
      EXPECT_GT(expected.rgba.a, 0.2);
      for (int c = 0; c < 4; ++c)
        EXPECT_NEAR(found.rgba[c], expected.rgba[c], found.error + expected.error + 1e-12);
    }
  }
}

TEST(ReferenceGradientOpacity, CutsAtTheKnotsOfItsCurve) {
  const Volume volume = squares();
  const auto depth = [&](const GradientOpacity& opacity) {
    return depthOf(alongRow(volume, {factored(0.3, opacity)})) / 0.3;
  };
  // Positions of cuts are accurate to 1e-13 of the largest |gradient|^2.
  constexpr double kClose = 1e-10;
  EXPECT_NEAR(depth({4, 10, {{0, 0}, {1, 1}}}), 1.5 + 6.5, kClose);
  EXPECT_NEAR(depth({10, 4, {{0, 0}, {1, 1}}}), 2.5 + 1.5, kClose);  // reversed
  EXPECT_NEAR(depth(step(7)), 11.5 - 3.5, kClose);
  EXPECT_NEAR(depth({0, 20, {{0, 0}, {0.5, 0}, {0.5, 1}, {0.75, 0.25}}}), 2.5 * 0.625 + 4 * 0.25, kClose);
  EXPECT_NEAR(depth({-10, -5, {{0, 0}, {1, 1}}}), 12, kClose);
  EXPECT_EQ(depth({22, 23, {{0, 0}, {1, 1}}}), 0);
  EXPECT_EQ(depth({0, 23, {{0, 0}}}), 0);
}

TEST(ReferenceGradientOpacity, CutsWhereDifferencesAreOneSided) {
  const Volume volume = squares();
  const auto depth = [&](double at) { return depthOf(alongRow(volume, {factored(0.3, step(at))})) / 0.3; };
  EXPECT_NEAR(depth(1.5), 11.5 - 1.0 / 3, 1e-10);          // 1 + 3x = 1.5 (1 + x)
  EXPECT_NEAR(depth(20.5), 11.5 - (10 + 2.0 / 3), 1e-10);  // 40 - 19w = 20.5 (2 - w)
  EXPECT_NEAR(depth(0.999), 12, 1e-10);
  EXPECT_EQ(depth(21.001), 0);
}

TEST(ReferenceGradientOpacity, OfAConstantOneChangesNothing) {
  RandomLight draw(5);
  for (int trial = 0; trial < 20; ++trial) {
    const Volume volume =
        makeVolume(gridOf({4, 5, 3}, {1, 0.5, 2}), {[&](int, int, int) { return draw.unit(); }});
    Scene scene = makeScene({ramp(0, 1, 2)});
    const glm::dvec3 origin(-9, 1, 2), direction(1, 0.1 * draw.unit(), 0.1 * draw.unit());
    const RayResult expected = traceReference(volume, scene, origin, direction);
    scene.channels[0].gradientOpacity = GradientOpacity{0, 1, {{0, 1}, {0.5, 1}, {1, 1}}};
    const RayResult found = traceReference(volume, scene, origin, direction);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(found.rgba[c], expected.rgba[c], 1e-12);
  }
}

TEST(ReferenceGradientOpacity, SeesADipOfTheGradientHoweverNarrow) {
  // |gradient| is |x - 5| from 4 to 6, and 1 elsewhere.
  const Volume volume = makeVolume(gridOf({11, 1, 1}), {[](int i, int, int) { return std::abs(i - 5); }});
  for (const double width : {1e-1, 1e-2, 1e-3, 1e-4}) {
    const GradientOpacity flat{0, 1, {{0, 1}, {width, 1}, {width, 0}}};
    // 1e-13 in the square of |gradient| is 1e-13 / (2 width) in x.
    EXPECT_NEAR(depthOf(alongRow(volume, {factored(1 / width, flat)})), 2, 1e-13 / (width * width) + 1e-10)
        << width;
  }
}

TEST(ReferenceGradientOpacity, IsExactWhereTheGradientIsNearlyZero) {
  // |gradient| is sqrt((x - 5)^2 + c^2) from 4 to 6, nearly a kink, and sqrt(1 + c^2) elsewhere.
  constexpr double c = 0x1p-10;
  const Volume volume =
      makeVolume(gridOf({11, 4, 1}), {[](int i, int j, int) { return std::abs(i - 5) + c * j; }});
  const Scene scene = makeScene({factored(0.3, {0, 1, {{0, 0}, {1, 1}}})});
  const RayResult found = traceReference(volume, scene, {-3, 1.5, 0}, {1, 0, 0});
  const double end = std::sqrt(1 - c * c);  // there it is 1
  const double length = 9 + (end + c * c * std::asinh(end / c)) + 2 * (1 - end);
  EXPECT_NEAR(found.rgba.a, -std::expm1(-0.3 * length), found.error + 1e-12);
  EXPECT_LE(found.error, 1e-7);
}

TEST(ReferenceGradientOpacity, IsZeroWhereADifferenceIsNotFinite) {
  // Cells [5, 7] have no scalar, and there is no gradient where x - 1 or x + 1 is in one of them.
  const Volume volume = makeVolume(gridOf({12, 1, 1}), {[](int i, int, int) { return i == 6 ? kNaN : i; }});
  EXPECT_NEAR(depthOf(alongRow(volume, {solid(0.3, kRed)})), 0.3 * 10, 1e-12);
  for (const std::vector<OpacityKnot>& one : {std::vector<OpacityKnot>{{0, 1}}, {{0, 1}, {1, 1}}})
    EXPECT_NEAR(depthOf(alongRow(volume, {factored(0.3, {0, 5, one})})), 0.3 * 8, 1e-12);
}

TEST(ReferenceGradientOpacity, OfASingleVoxelIsThatOfNoGradient) {
  const Volume volume = makeVolume(gridOf({1, 1, 1}), {[](int, int, int) { return 7; }});
  EXPECT_NEAR(depthOf(alongRow(volume, {factored(2, {0, 1, {{0, 0.25}, {1, 1}}})})), 0.5, 1e-12);
  EXPECT_NEAR(depthOf(alongRow(volume, {factored(2, step(0))})), 2, 1e-12);  // 1 at lo and above
  EXPECT_NEAR(depthOf(alongRow(volume, {factored(2, {0, 1, {{0, 0.25}, {0, 0.5}, {1, 1}}})})), 1, 1e-12);
}

TEST(ReferenceGradientOpacity, HandsOverBetweenChannelsWhereTheFactorMakesOneTheLargest) {
  // The extinction of red is (2x - 4) / 6 from 2 to 5 and then 1, that of blue is 0.5: they are equal at 3.5.
  const Volume volume = squares(12, 2);
  const ChannelAppearance red = factored(1, {4, 10, {{0, 0}, {1, 1}}}, kRed), blue = solid(0.5, kBlue);
  const double blueAlone = -std::expm1(-0.5 * 4), behind = std::exp(-0.5 * 4),
               redBehind = behind * -std::expm1(-(1.5 * 0.75 + 6.5));
  for (const bool blueFirst : {false, true}) {
    const std::vector<ChannelAppearance> channels =
        blueFirst ? std::vector<ChannelAppearance>{blue, red} : std::vector<ChannelAppearance>{red, blue};
    const RayResult most = alongRow(volume, channels, BlendMode::max);
    EXPECT_NEAR(most.rgba.b, blueAlone, most.error + 1e-10);
    EXPECT_NEAR(most.rgba.r, redBehind, most.error + 1e-10);
    const RayResult mixed = alongRow(volume, channels, BlendMode::mix);
    EXPECT_NEAR(mixed.rgba.a, most.rgba.a, most.error + mixed.error);
    EXPECT_GT(mixed.rgba.b, most.rgba.b + 0.01);
    const RayResult each = alongRow(volume, channels, BlendMode::composite);
    EXPECT_NEAR(each.rgba.b, -std::expm1(-0.5 * 12), each.error + 1e-10);
    EXPECT_NEAR(each.rgba.r, -std::expm1(-(1.5 + 6.5)), each.error + 1e-10);
  }
}

TEST(ReferenceGradientOpacity, RefusesWhatHasNoMeaning) {
  const Volume volume = squares();
  const auto trace = [&](const GradientOpacity& opacity) { alongRow(volume, {factored(1, opacity)}); };
  EXPECT_NO_THROW(trace({3, 3, {{0, 1}}}));
  EXPECT_THROW(trace({0, kNaN, {{0, 1}}}), Error);
  EXPECT_THROW(trace({-std::numeric_limits<double>::infinity(), 1, {{0, 1}}}), Error);
  EXPECT_THROW(trace({0, 1, {}}), Error);
  EXPECT_THROW(trace({0, 1, {{0.5, 0}, {0.25, 1}}}), Error);
}

/// Between two cuts |gradient| stays between the same two knots of the factor, and is monotonic.
TEST(FactorAlong, HasOnePieceAndNoExtremumBetweenItsCuts) {
  int pieces = 0, whole = 0;
  for (unsigned seed = 1; seed <= 120; ++seed) {
    RandomLight draw(seed);
    const Volume volume = draw.volume();
    const glm::ivec3 dims = volume.grid().dims;
    const auto interpolation = seed <= 60 ? Interpolation::trilinear : Interpolation::cubic;
    const ScalarField field(volume.channels()[0], dims, interpolation);
    const glm::dmat3 voxelFromWorld = glm::inverse(glm::dmat3(volume.grid().worldFromVoxel));
    const double steepest = test::gradientQuantile(volume, 0, 1);
    const GradientOpacity opacity{0, steepest, {{0.1, 1}, {0.3, 0.5}, {0.3, 0.8}, {0.6, 1}, {0.9, 0.1}}};
    const ChannelAppearance look = factored(1, opacity);
    const ActiveChannel channel{0,
                                field,
                                ChannelCurves(look),
                                1,
                                true,
                                {},
                                1,
                                GradientFactor(opacity, glm::transpose(voxelFromWorld))};
    for (int i = 0; i < 10; ++i) {
      const glm::dvec3 direction = draw.vector();
      const glm::dvec3 through = glm::dvec3(draw.unit(), draw.unit(), draw.unit()) * glm::dvec3(dims) - 0.5;
      const RayCells cells = cutAtCells(through, voxelFromWorld * direction, dims);
      whole += int(cells.cuts.size()) - 1;
      forEachSmoothPart(cells, dims, Clipping(Scene(), volume.grid()), BlendMode::density, {&channel, 1},
                        [&](const Stretch& stretch, double begin, double end) {
                          if (stretch.channels.empty() || end - begin < 1e-4) return true;
                          ++pieces;
                          double least = steepest * 10, most = 0, last = -1;
                          bool rises = false, falls = false;
                          for (int k = 0; k <= 20; ++k) {
                            const glm::dvec3 p = stretch.point(std::lerp(begin, end, 0.001 + 0.998 * k / 20));
                            const double g = glm::length(glm::transpose(voxelFromWorld) * field.gradient(p));
                            least = std::min(least, g);
                            most = std::max(most, g);
                            if (last >= 0 && std::abs(g - last) > 1e-9 * steepest)
                              (g > last ? rises : falls) = true;
                            last = g;
                          }
                          EXPECT_FALSE(rises && falls) << seed;
                          for (const OpacityKnot& knot : opacity.factor) {
                            const double value = knot.position * steepest;
                            EXPECT_FALSE(least < value * (1 - 1e-9) && most > value * (1 + 1e-9)) << seed;
                          }
                          return true;
                        });
    }
  }
  EXPECT_GT(pieces, whole * 5 / 4);
}

}  // namespace
}  // namespace scolopax::reference
