// SPDX-License-Identifier: Apache-2.0
#include "renderer/reference/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "renderer/core/error.h"
#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

Camera perspective(glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up, double fovY) {
  Camera camera;
  camera.eye = eye;
  camera.target = target;
  camera.up = up;
  camera.fovY = fovY;
  return camera;
}

/// A cube of 4 world units around the origin, seen along -z in 8x8 pixels of 1 unit.
struct CubeView {
  Volume volume =
      makeVolume(gridOf(glm::ivec3(4), glm::dvec3(1), glm::dvec3(-1.5)), {[](int, int, int) { return 1; }});
  Scene scene = makeScene({solid(0.4, {1, 0.5, 0})});
  CubeView() {
    scene.camera = {.eye = {0, 0, 10}, .target = {0, 0, 0}, .up = {0, 1, 0}, .orthoHeight = 8.0};
    scene.width = scene.height = 8;
  }
  const glm::vec4& pixel(const ReferenceImage& r, int x, int y) const {
    return r.image.pixels[std::size_t(x + y * scene.width)];
  }
};

TEST(RenderReference, OrthographicCubeHasItsClosedFormInsideAndNothingOutside) {
  const CubeView view;
  const ReferenceImage result = renderReference(view.volume, view.scene, 2);
  const double alpha = 1 - std::exp(-0.4 * 4);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      const bool inside = x >= 2 && x < 6 && y >= 2 && y < 6;
      EXPECT_NEAR(view.pixel(result, x, y).a, inside ? alpha : 0.0, 1e-6) << x << ' ' << y;
      EXPECT_NEAR(view.pixel(result, x, y).g, inside ? 0.5 * alpha : 0.0, 1e-6) << x << ' ' << y;
      EXPECT_LT(result.standardError[std::size_t(x + 8 * y)].a, 1e-9);
    }
  EXPECT_LE(result.maximumRayError, 1e-7);
}

TEST(RenderReference, APixelCutByAnEdgeHoldsItsShareWithinItsStandardError) {
  CubeView view;
  view.scene.camera.eye.x = view.scene.camera.target.x = 0.3;  // edges cut pixels at 0.3 and 0.7
  const double alpha = 1 - std::exp(-0.4 * 4);
  double squares = 0;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const ReferenceImage result = renderReference(view.volume, view.scene, 5, seed);
    for (int y = 2; y < 6; ++y) {
      const double error = result.standardError[std::size_t(1 + 8 * y)].a;
      squares += std::pow((view.pixel(result, 1, y).a - 0.3 * alpha) / alpha, 2);
      EXPECT_LT(error, 0.5 * alpha / 5);
      ++count;
    }
  }
  // Only the 5 strata of the column with the edge vary, each cut at its middle: two points of variance 1/4.
  const double expected = std::sqrt(5 * 0.25 / 2) / 25;
  EXPECT_NEAR(std::sqrt(squares / count), expected, 0.2 * expected);
}

TEST(RenderReference, StandardErrorHasTheSizeOfTheDifferencesBetweenSeeds) {
  CubeView view;
  view.scene.camera = perspective({5, 6, 7}, {0, 0, 0}, {0, 1, 0}, 50);
  double predicted = 0, observed = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const ReferenceImage a = renderReference(view.volume, view.scene, 3, 2 * seed);
    const ReferenceImage b = renderReference(view.volume, view.scene, 3, 2 * seed + 1);
    for (std::size_t i = 0; i < a.image.pixels.size(); ++i) {
      observed += std::pow(a.image.pixels[i].a - b.image.pixels[i].a, 2);
      predicted += std::pow(a.standardError[i].a, 2) + std::pow(b.standardError[i].a, 2);
    }
  }
  EXPECT_GT(predicted, 0);
  EXPECT_NEAR(observed / predicted, 1, 0.2);
}

TEST(RenderReference, PointFilterLooksThroughPixelCentres) {
  CubeView view;
  view.scene.filter = PixelFilter::point;
  view.scene.camera = perspective({3, 4, 5}, {0.5, 0, 0}, {0, 0, 1}, 60);
  view.scene.width = 5;
  view.scene.height = 3;
  const ReferenceImage result = renderReference(view.volume, view.scene, 1);
  // Pixel (4, 0): two pixels to the right of the middle and one above it.
  const glm::dvec3 forward = glm::normalize(glm::dvec3(-2.5, -4, -5));
  const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0, 0, 1))),
                   up = glm::cross(right, forward);
  const double pixel = 2 * std::tan(3.14159265358979323846 / 6) / 3;
  const RayResult ray =
      traceReference(view.volume, view.scene, {3, 4, 5}, forward + 2 * pixel * right + pixel * up);
  const RayResult middle = traceReference(view.volume, view.scene, {3, 4, 5}, forward);
  EXPECT_EQ(view.pixel(result, 4, 0), glm::vec4(ray.rgba));
  EXPECT_NEAR(view.pixel(result, 2, 1).a, middle.rgba.a, 1e-7);
  EXPECT_GT(view.pixel(result, 2, 1).a, 0.1f);
  EXPECT_EQ(result.standardError[0], glm::vec4(0));
}

TEST(RenderReference, FirstPixelIsTopLeft) {
  // Only the voxel at low x and high y in world space is visible.
  const Volume volume = makeVolume(gridOf(glm::ivec3(2), glm::dvec3(2), glm::dvec3(-1)),
                                   {[](int i, int j, int) { return i == 0 && j == 1; }});
  CubeView view;
  view.scene.channels = {ramp(0, 1, 1)};
  view.scene.width = view.scene.height = 2;
  view.scene.camera.orthoHeight = 4.0;
  const ReferenceImage result = renderReference(volume, view.scene, 4);
  EXPECT_GT(view.pixel(result, 0, 0).a, 2 * view.pixel(result, 1, 0).a);
  EXPECT_GT(view.pixel(result, 0, 0).a, 2 * view.pixel(result, 0, 1).a);
  EXPECT_GT(view.pixel(result, 1, 0).a, view.pixel(result, 1, 1).a);
}

TEST(RenderReference, LooksAlongItsUpDirectionToo) {
  CubeView view;
  view.scene.camera.up = {0, 0, 1};
  const ReferenceImage result = renderReference(view.volume, view.scene, 1);
  EXPECT_NEAR(view.pixel(result, 4, 4).a, 1 - std::exp(-0.4 * 4), 1e-6);
}

TEST(RenderReference, TheSameSeedIsTheSamePicture) {
  CubeView view;
  view.scene.camera = perspective({5, 6, 7}, {0, 0, 0}, {0, 1, 0}, 50);
  const ReferenceImage a = renderReference(view.volume, view.scene, 2, 7),
                       b = renderReference(view.volume, view.scene, 2, 7);
  EXPECT_EQ(a.image.pixels, b.image.pixels);
  EXPECT_NE(a.image.pixels, renderReference(view.volume, view.scene, 2, 8).image.pixels);
}

TEST(RenderReference, EveryThirdPixelIsThatOfTheWholePicture) {
  CubeView view;
  view.scene.width = view.scene.height = 9;
  view.scene.filter = PixelFilter::point;
  view.scene.camera = perspective({3, 4, 5}, {0.5, 0, 0}, {0, 0, 1}, 60);
  const ReferenceImage whole = renderReference(view.volume, view.scene, 1);
  const ReferenceImage few = renderReference(view.volume, view.scene, {.every = 3});
  ASSERT_EQ(few.image.width, 3);
  ASSERT_EQ(few.image.height, 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x)
      EXPECT_EQ(few.image.pixels[std::size_t(x + 3 * y)], view.pixel(whole, 3 * x + 1, 3 * y + 1))
          << x << ' ' << y;
  // Of an even number, the second pixel of the middle two.
  view.scene.width = view.scene.height = 4;
  EXPECT_EQ(renderReference(view.volume, view.scene, {.every = 4}).image.pixels[0],
            view.pixel(renderReference(view.volume, view.scene, 1), 2, 2));
  view.scene.width = view.scene.height = 9;
  // With the box filter, pixels keep their area: that with the edge at 0.3 has 0.3 of the alpha.
  view.scene.filter = PixelFilter::box;
  view.scene.camera = {
      .eye = {0.8, 0, 10}, .target = {0.8, 0, 0}, .up = {0, 1, 0}, .orthoHeight = 9.0};  // edge at pixel 1.7
  const ReferenceImage box = renderReference(view.volume, view.scene, {.samplesPerAxis = 16, .every = 3});
  EXPECT_NEAR(box.image.pixels[3].a, 0.3 * (1 - std::exp(-0.4 * 4)), 0.01);
}

TEST(RenderReference, ASmallerToleranceIsSmallerAnErrorInLight) {
  // A ball in the light and shadow of a lump beside it.
  const Volume volume =
      makeVolume(gridOf(glm::ivec3(6), glm::dvec3(1), glm::dvec3(-2.5)), {[](int i, int j, int k) {
                   return std::max(0, 9 - (i - 2) * (i - 2) - (j - 3) * (j - 3) - (k - 2) * (k - 2)) +
                          (i == 5 && j > 3 ? 9 : 0);
                 }});
  Scene scene = makeScene({ramp(0, 9, 0.8)});
  scene.camera = perspective({2, 3, 12}, {0, 0, 0}, {0, 1, 0}, 35);
  scene.width = scene.height = 8;
  scene.filter = PixelFilter::point;
  scene.shading = scene.shadows = true;
  scene.lights.resize(1);
  scene.lights[0].type = LightType::directional;
  scene.lights[0].vector = {-1, -0.4, -0.3};
  const ReferenceImage best = renderReference(volume, scene, {.tolerance = 1e-7});
  double before = 1;
  for (const double tolerance : {1e-4, 1e-5, 1e-6}) {
    const ReferenceImage found = renderReference(volume, scene, {.tolerance = tolerance});
    double largest = 0;
    for (std::size_t i = 0; i < best.image.pixels.size(); ++i)
      for (int c = 0; c < 4; ++c)
        largest =
            std::max(largest, std::abs(double(found.image.pixels[i][c]) - double(best.image.pixels[i][c])));
    EXPECT_LT(largest, found.maximumRayError + best.maximumRayError + 1e-7) << tolerance;
    EXPECT_LT(found.maximumRayError, 0.3 * before) << tolerance;
    before = found.maximumRayError;
  }
}

TEST(RenderReference, RefusesOptionsThatMakeNoSense) {
  const CubeView view;  // 8x8
  for (const int every : {0, -1, 3, 16})
    EXPECT_THROW(renderReference(view.volume, view.scene, {.every = every}), Error) << every;
  for (const double tolerance : {0.0, -1.0, 1.0, std::nan("")})
    EXPECT_THROW(renderReference(view.volume, view.scene, {.tolerance = tolerance}), Error) << tolerance;
}

TEST(RenderReference, RefusesWhatCannotBeSeen) {
  CubeView view;
  EXPECT_THROW(renderReference(view.volume, view.scene, 0), Error);
  view.scene.camera.target = view.scene.camera.eye;
  EXPECT_THROW(renderReference(view.volume, view.scene, 1), Error);
  view.scene.camera.target = {0, 0, 0};
  EXPECT_NO_THROW(renderReference(view.volume, view.scene, 1));
  view.scene.channels.clear();
  EXPECT_THROW(renderReference(view.volume, view.scene, 1), Error);
}

}  // namespace
}  // namespace scolopax::reference
