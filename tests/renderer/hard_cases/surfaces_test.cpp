// SPDX-License-Identifier: Apache-2.0
// Surfaces in quadrature, without noise, against the reference: it meets exactly the same surfaces with every
// step.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/renderer/hard_cases/hard_scenes.h"

namespace scolopax {
namespace {

using namespace test;

/// Surfaces alone, without matter.
ChannelAppearance surfaces(std::vector<Isovalue> isovalues, glm::dvec3 color = kWhite) {
  ChannelAppearance look = ramp(0, 1, 1, color);
  look.opacity = {{0, 0}};
  look.isovalues = std::move(isovalues);
  return look;
}

/// Compares one sample of each kind of quadrature with the reference, in all components. At most
/// `silhouettes` of the pixels may differ: where a ray grazes a surface, rounding decides whether it meets
/// it.
void expectSameAsReference(const std::shared_ptr<const Volume>& volume, Scene scene, int silhouettes = 0,
                           double tolerance = 2e-5) {
  scene.filter = PixelFilter::point;
  const auto expected = reference::renderReference(*volume, scene, 1);
  double seen = 0;
  for (const glm::vec4& pixel : expected.image.pixels) seen += pixel.a;
  ASSERT_GT(seen, 0) << "no surface is in view";
  for (const double step : {0.0, 0.5, 4.0}) {
    scene.method = Method::raymarch;
    scene.step = step;
    const Image found = renderSamples(volume, scene, 1);
    int different = 0;
    double worst = 0;
    for (std::size_t i = 0; i < found.pixels.size(); ++i) {
      double most = 0;
      for (int c = 0; c < 4; ++c)
        most = std::max(most, std::abs(double(found.pixels[i][c]) - double(expected.image.pixels[i][c])));
      if (most > tolerance + expected.maximumRayError) ++different;
      worst = std::max(worst, most);
    }
    EXPECT_LE(different, silhouettes) << "step " << step << ", at most by " << worst;
  }
}

TEST(Surfaces, AreMetOnceInCellsOfAnySize) {
  const glm::ivec3 dims(13, 12, 11);
  const auto volume = volumeOf(gridOf(dims, {1, 0.7, 1.6}), channelOf<float>(dims, lumps()));
  for (const int macrocell : {1, 2, 4, 16}) {
    Scene scene = viewFrom(*volume, {-9, -12, -20}, {6, 4, 8}, 40, 48);
    scene.macrocell = macrocell;
    scene.channels = {surfaces({{0.52, 0.3, kRed}, {0.8, 0.5, kGreen}, {0.15, 1, kBlue}})};
    expectSameAsReference(volume, scene, 4);
  }
}

TEST(Surfaces, OfSplinesAreMetOnTheSpline) {
  // Between voxels that alternate, a cubic through four points of a cell is far off: it would meet a surface
  // at 134, which the spline, below 132.2, does not reach.
  const glm::ivec3 dims(12);
  const auto checkers = [](int x, int y, int z) { return 255 * ((x + y + z) % 2); };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, checkers));
  Scene scene = viewFrom(*volume, {-20, -17, -23}, {5.5, 5.5, 5.5}, 20, 24);
  scene.crop = Crop{};
  scene.crop->low = glm::dvec3(1.5);
  scene.crop->high = glm::dvec3(9.5);
  scene.channels = {surfaces({{134, 1, kRed}})};
  scene.channels[0].interpolation = Interpolation::cubic;
  scene.filter = PixelFilter::point;
  scene.method = Method::raymarch;
  scene.step = 0;
  for (const glm::vec4& pixel : renderSamples(volume, scene, 1).pixels) EXPECT_EQ(pixel.a, 0);

  scene.crop.reset();
  for (const double value : {129.0, 125.3}) {
    scene.channels[0].isovalues = {{value, 0.4, kRed}};
    expectSameAsReference(volume, scene, 12);
  }
  const glm::ivec3 size(9, 8, 10);
  const auto smooth = volumeOf(gridOf(size, {1, 0.6, 1.4}), channelOf<float>(size, lumps()));
  scene = viewFrom(*smooth, {-9, -12, -20}, {4, 2, 6}, 30, 32);
  scene.channels = {surfaces({{0.5, 0.3, kRed}, {0.7, 0.5, kGreen}})};
  scene.channels[0].interpolation = Interpolation::cubic;
  expectSameAsReference(smooth, scene, 6);
}

TEST(Surfaces, OnGridsOfAnyShapeDoNotShadowThemselves) {
  // On long axes of wide spacing, the rounding of points is more than a small part of the smallest spacing.
  const glm::ivec3 dims(8, 8, 512);
  for (const double spacing : {1.0, 100.0, 1e4}) {
    const auto volume =
        volumeOf(gridOf(dims, {1, 1, spacing}), channelOf<float>(dims, [](int, int, int z) { return z; }));
    for (const double value : {400.3, 77.9}) {
      Scene scene =
          viewFrom(*volume, {3.1, 3.3, -600 * spacing}, {3.5, 3.5, 255 * spacing}, 0.6 / spacing, 16);
      scene.channels = {surfaces({{value, 1, kRed}})};
      scene.channels[0].rangeHi = 512;
      scene.channels[0].material = {0, 1, 0, 10};
      scene.filter = PixelFilter::point;
      scene.shadows = true;
      scene.lights = {{LightType::directional, {0, 0, 1}, glm::dvec3(1), 1}};
      for (const Method method : {Method::raymarch, Method::superposed}) {
        scene.method = method;
        int seen = 0, dark = 0;
        for (const glm::vec4& pixel : renderSamples(volume, scene, 1).pixels) {
          seen += pixel.a > 0.5f;
          dark += pixel.a > 0.5f && pixel.r < 0.99f;
        }
        EXPECT_GT(seen, 50) << spacing << ' ' << value;
        EXPECT_EQ(dark, 0) << spacing << ' ' << value << ' ' << nameOf(method);
      }
    }
  }
}

TEST(Surfaces, ThroughSaddlesAreMetBeyondRounding) {
  // At 0.5 the field is a product of factors that change sign: two sheets cross, and rays near the crossing
  // meet both within rounding, or neither.
  const glm::ivec3 dims(13, 12, 11);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, lumps()));
  Scene scene = viewFrom(*volume, {-9, -12, -20}, {6, 4, 8}, 40, 48);
  scene.channels = {surfaces({{0.5, 0.3, kRed}})};
  expectSameAsReference(volume, scene, 12);  // of 2304
}

TEST(Surfaces, OfWholeNumbersAtAndBetweenStoredValues) {
  // Few values, so that plateaus, faces and corners of cells lie exactly at the isovalue.
  const glm::ivec3 dims(12, 12, 12);
  const auto steps = [](int x, int y, int z) { return std::floor(4 * lumps()(x, y, z)); };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, steps));
  for (const double value : {0.5, 1.0, 1.5, 2.0, 3.0}) {
    SCOPED_TRACE(value);
    Scene scene = viewFrom(*volume, {-9, -12, -20}, {5.5, 5, 5.5}, 40, 48);
    scene.channels = {surfaces({{value, 0.4, kRed}})};
    expectSameAsReference(volume, scene, 8);
  }
}

TEST(Surfaces, AlongTheFacesOfCells) {
  // Rays that run along faces, edges and through corners; layers of one value across the rays.
  const glm::ivec3 dims(8, 8, 8);
  const auto layers = [](int, int, int z) { return z; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, layers));
  for (const double value : {0.0, 1.0, 3.0, 3.25, 7.0}) {
    SCOPED_TRACE(value);
    Scene scene = frontScene(*volume, 16, 16);  // half of the rays pass through voxel centres
    scene.channels = {surfaces({{value, 0.4, kRed}, {5, 0.25, kBlue}})};
    expectSameAsReference(volume, scene);
    scene.camera.eye = 2.0 * scene.camera.target - scene.camera.eye;
    expectSameAsReference(volume, scene);
  }
}

TEST(Surfaces, ThatCoincideAreMetInOrder) {
  const glm::ivec3 dims(9, 9, 9);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<float>(dims, lumps(1)), channelOf<float>(dims, lumps(1)));
  for (const double apart : {0.0, 1e-5, 1e-3}) {
    SCOPED_TRACE(apart);
    for (const BlendMode blend : kBlends) {
      Scene scene = viewFrom(*volume, {-9, -12, -20}, {4, 4, 4}, 30, 32);
      scene.blend = blend;
      scene.channels = {surfaces({{0.5, 0.5, kRed}, {0.5 + apart, 0.25, kGreen}}),
                        surfaces({{0.5, 0.75, kBlue}})};
      // Rays end at a transmittance of 1e-4. Roots that are closer than floats tell are met in either order.
      expectSameAsReference(volume, scene, apart == 1e-5 ? 10 : 3, 1.2e-4);
    }
  }
}

TEST(Surfaces, AtValuesOfEveryTypeAndSlope) {
  const glm::ivec3 dims(9, 8, 7);
  const auto scaled = [](int kind, double by, double offset = 0) {
    return [=](int x, int y, int z) { return offset + by * lumps(kind)(x, y, z); };
  };
  const auto volume =
      volumeOf(gridOf(dims, {1, 0.6, 1.4}), channelOf<std::uint8_t>(dims, scaled(0, 250), 0.01, -5),
               channelOf<std::int16_t>(dims, scaled(1, 60000, -30000), -2, 300),
               channelOf<std::uint16_t>(dims, scaled(2, 65000), 1e-4),
               channelOf<float>(dims, scaled(3, 1e-20), 1e3, 7e-18));
  for (std::size_t n = 0; n < 4; ++n) {
    SCOPED_TRACE(n);
    Scene scene = viewFrom(*volume, {-7, -9, -12}, {4, 2.1, 4.2}, 45, 32);
    const Histogram& values = volume->channels()[n].histogram;
    for (std::size_t k = 0; k < 4; ++k) scene.channels[k].visible = k == n;
    for (const bool reversed : {false, true}) {
      ChannelAppearance look = surfaces({{std::lerp(values.minimum, values.maximum, 0.45), 0.6, {}}});
      look.rangeLo = reversed ? values.maximum : values.minimum;
      look.rangeHi = reversed ? values.minimum : values.maximum;
      look.gamma = 1.7;
      look.color = {{0, kRed}, {1, kBlue}};
      scene.channels[n] = look;
      expectSameAsReference(volume, scene, 3);
    }
  }
}

TEST(Surfaces, AtPeaksOfAnyWidth) {
  const glm::ivec3 dims(10, 10, 10);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, lumps(2)));
  for (const double width : {1e-1, 1e-3, 1e-5, 0.0}) {
    SCOPED_TRACE(width);
    Scene scene = viewFrom(*volume, {-9, -12, -20}, {4.5, 4.5, 4.5}, 35, 32);
    ChannelAppearance& look = scene.channels[0] = ramp(0, 1, 0.8, kGreen);
    look.color = {{0, kRed}, {1, kBlue}};
    look.opacity = {{0, 0},   {0.4 - width, 0}, {0.4 - width, 0.2}, {0.4, 0.9}, {0.4 + width, 0.1},
                    {0.7, 0}, {0.75, 0.5},      {0.85, 0.5},        {0.9, 0}};
    look.peaks = Peaks::only;
    expectSameAsReference(volume, scene, 3);
  }
}

TEST(Surfaces, NearVoxelsThatAreNotFiniteAndClipPlanes) {
  constexpr float kBad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()};
  const glm::ivec3 dims(14, 13, 12);
  const auto holed = [&](int x, int y, int z) {
    const int i = x + 14 * (y + 13 * z);
    return i % 97 == 31 ? kBad[i % 3] : float(lumps()(x, y, z));
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, holed), channelOf<float>(dims, lumps(1)));
  Scene scene = viewFrom(*volume, {-9, -12, -20}, {6.5, 6, 5.5}, 40, 48);
  scene.channels = {surfaces({{0.52, 0.6, kRed}}), surfaces({{0.3, 0.5, kBlue}})};
  expectSameAsReference(volume, scene, 3);
  scene.clip = {{{6, 6, 6}, {1, 0.3, -0.4}, {}}, {{5, 7, 6}, {-0.2, 1, 0.1}, std::vector<int>{1}}};
  expectSameAsReference(volume, scene, 3);
  scene.crop = Crop{{3, 2, 4}, {9, 10, 8}, 0x5a3c9e1u};
  expectSameAsReference(volume, scene, 4);
}

TEST(Surfaces, InVolumesOfSingleLayers) {
  for (const glm::ivec3 dims :
       {glm::ivec3(1, 7, 5), glm::ivec3(6, 1, 7), glm::ivec3(5, 6, 1), glm::ivec3(2), glm::ivec3(1, 1, 9)}) {
    SCOPED_TRACE(testing::Message() << dims.x << ' ' << dims.y << ' ' << dims.z);
    const auto volume = volumeOf(gridOf(dims, {1, 1.5, 0.7}), channelOf<float>(dims, [](int x, int y, int z) {
                                   return std::sin(1.7 * x + 2.3 * y + 1.1 * z);
                                 }));
    const glm::dvec3 centre(volume->grid().worldFromVoxel * glm::dvec4(glm::dvec3(dims - 1) * 0.5, 1));
    Scene scene = viewFrom(*volume, centre + glm::dvec3(4, -5, 9), centre, 50, 32);
    scene.channels = {surfaces({{0.1, 0.6, kRed}, {-0.4, 0.5, kGreen}})};
    expectSameAsReference(volume, scene, 3);
  }
}

TEST(Surfaces, OutsideTheValuesCostNothing) {
  const glm::ivec3 dims(16, 16, 16);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, lumps()));
  Scene scene = viewFrom(*volume, {-9, -12, -20}, {7, 7, 7}, 40, 16);
  scene.channels = {surfaces({{1.5, 1, kRed}, {-3, 1, kRed}, {1e300, 1, kRed}})};
  for (const Method method : {Method::superposed, Method::raymarch})
    EXPECT_EQ(statsOf(volume, scene, method, 1).fetches, 0u) << nameOf(method);
}

TEST(Surfaces, BesideEmptyMacrocellsSeenFromAfar) {
  // The isovalue is close to the value of the empty space around a block, whose faces are faces of
  // macrocells.
  const glm::ivec3 dims(24, 24, 24);
  const auto block = [](int x, int y, int z) {
    return std::min({x, y, z}) >= 8 && std::max({x, y, z}) <= 16 ? 255 : 0;
  };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, block));
  for (const double away : {1.0, 30.0, 1000.0}) {
    SCOPED_TRACE(away);
    Scene scene =
        viewFrom(*volume, glm::dvec3(12) + away * glm::dvec3(-15, -21, -33), {12, 12, 12}, 40 / away, 32);
    for (const double value : {0.01, 0.1, 254.9}) {
      scene.channels = {surfaces({{value, 0.4, kRed}})};
      expectSameAsReference(volume, scene, 3);
    }
  }
}

TEST(Surfaces, AreSoManyThatARayEnds) {
  const glm::ivec3 dims(3, 3, 1200);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int z) { return z % 2 ? 200 : 0; }));
  Scene scene = frontScene(*volume, 8, 8);
  scene.channels = {surfaces({{100, 1e-4, kRed}})};
  EXPECT_EQ(statsOf(volume, scene, Method::raymarch, 1).truncatedRays, 64u);
  EXPECT_GT(statsOf(volume, scene, Method::superposed, 1).truncatedRays, 50u);  // 5 % end at a surface
}

TEST(Surfaces, HideWhatIsBehindThemInMatter) {
  // Homogeneous matter of one colour, in front of and behind a plane.
  const glm::ivec3 dims(6, 6, 12);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int z) { return 10 * z; }));
  for (const double opacity : {0.3, 1.0})
    for (const BlendMode blend : kBlends) {
      Scene scene = frontScene(*volume, 8, 8);
      scene.blend = blend;
      scene.channels = {solid(0.2, kGreen)};
      scene.channels[0].isovalues = {{33, opacity, kRed}};
      expectSameAsReference(volume, scene);
    }
}

}  // namespace
}  // namespace scolopax
