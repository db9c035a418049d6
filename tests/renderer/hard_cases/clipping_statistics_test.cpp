// SPDX-License-Identifier: Apache-2.0
// Clip planes and crop: through voxel centres and faces, along rays, through the eye, and with nothing left.
#include <gtest/gtest.h>

#include <functional>

#include "renderer/metrics/metrics.h"
#include "tests/renderer/hard_cases/hard_scenes.h"
#include "tests/support/agreement.h"
#include "tests/support/estimator_scenes.h"

namespace scolopax {
namespace {

using namespace test;

TEST(Clipping, LeavesOfABoxWhatIsOnTheKeptSideOfAPlane) {
  const glm::ivec3 dims(6, 6, 9);
  const auto volume =
      volumeOf(gridOf(dims, {1, 1, 0.5}), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  for (const double voxel : {-0.5, 0.0, 2.0, 3.5, 4.25, 8.0, 8.5})
    for (const double sign : {1.0, -1.0}) {
      SCOPED_TRACE(testing::Message() << "plane at " << voxel << ", kept side " << sign);
      Scene scene = frontScene(*volume, 8, 8);
      scene.channels = {solid(0.7, kRed)};
      scene.clip = {{{0, 0, 0.5 * voxel}, {0, 0, 3 * sign}, {}}};
      const double depth = 0.7 * 0.5 * (sign > 0 ? 8.5 - voxel : voxel + 0.5);
      if (depth == 0) {
        for (const Method method : kAllMethods)
          for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 2).pixels)
            ASSERT_LT(pixel.a, 1e-6) << nameOf(method);
        continue;
      }
      expectThickness(volume, scene, depth, kRed, 300);
      expectMarchedThickness(volume, scene, depth, {0.3, 5.0});
    }
}

TEST(Clipping, AtAPlaneAlongTheRaysKeepsThoseInThePlane) {
  const glm::ivec3 dims(8, 8, 4);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }),
                               channelOf<std::uint8_t>(dims, [](int, int, int) { return 0; }));
  for (const bool some : {false, true})
    for (const double sign : {1.0, -1.0}) {
      Scene scene = frontScene(*volume, 8, 8);  // rays through voxel centres
      scene.filter = PixelFilter::point;
      scene.channels = {solid(1e3, kRed), ramp(0, 1, 1)};
      scene.channels[1].opacity = {{0, 1e-9}};
      scene.clip = {{{3, 0, 0}, {sign, 0, 0}, {}}};
      if (some) scene.clip[0].channels = {0};
      const auto reference = reference::renderReference(*volume, scene, 1).image;
      // Which side the columns are on is left to the reference; that the column on the plane is kept is
      // checked here.
      int kept = 0;
      for (int column = 0; column < 8; ++column) kept += reference.pixels[std::size_t(column)].a > 0.5f;
      EXPECT_EQ(kept, sign > 0 ? 5 : 4);
      for (const Method method : kAllMethods) {
        const Image found = renderAnalog(volume, scene, method, 4);
        for (std::size_t i = 0; i < found.pixels.size(); ++i)
          ASSERT_NEAR(found.pixels[i].a, reference.pixels[i].a, 1e-3) << nameOf(method) << " pixel " << i;
      }
    }
}

TEST(Clipping, OfEverythingLeavesNothing) {
  const auto volume = testScene(TestScene::lumps)->volume;
  Scene scene = testScene(TestScene::lumps)->scene;
  scene.shading = scene.shadows = true;
  const auto expectNothing = [&](const char* what) {
    for (const Method method : kAllMethods)
      for (const glm::vec4& pixel : renderAnalog(volume, scene, method, 2).pixels)
        ASSERT_EQ(pixel, glm::vec4(0)) << nameOf(method) << ' ' << what;
  };
  const glm::dvec3 eye = scene.camera.eye, forward = scene.camera.target - eye;
  scene.clip = {{eye, -forward, {}}};  // cuts away everything behind the eye
  expectNothing("a plane through the eye");
  scene.clip = {{eye + 1e9 * forward, forward, {}}};
  expectNothing("a plane far away");
  scene.clip = {{scene.camera.target, {1, 0, 0}, {}}, {scene.camera.target - 1e-3, {-1, 0, 0}, {}}};
  expectNothing("two planes back to back");
  scene.clip = {{eye, -forward, std::vector<int>{0, 1, 2, 3}}};
  scene.clip[0].channels->resize(scene.channels.size());
  expectNothing("a plane that names all channels");
  scene.clip.clear();
  scene.crop = Crop{{2, 2, 2}, {5, 5, 5}, 0};
  expectNothing("no region");
  scene.crop = Crop{{2, 2, 2}, {2, 5, 5}, Crop::kInnermost};
  expectNothing("a region without volume");
  scene.crop = Crop{{100, 100, 100}, {200, 200, 200}, Crop::kInnermost};
  expectNothing("a region outside");
}

TEST(Clipping, OfNothingChangesNoBit) {
  const auto volume = testScene(TestScene::lumps)->volume;
  for (const Method method : kAllMethods) {
    Scene scene = testScene(TestScene::lumps)->scene;
    scene.shading = scene.shadows = true;
    const Image before = renderAnalog(volume, scene, method, 3);
    const glm::dvec3 forward = scene.camera.target - scene.camera.eye;
    scene.clip = {{scene.camera.eye, forward, {}}, {scene.camera.eye, -forward, std::vector<int>()}};
    scene.crop = Crop{glm::dvec3(-9), glm::dvec3(99), Crop::kInnermost};
    EXPECT_EQ(renderAnalog(volume, scene, method, 3).pixels, before.pixels) << nameOf(method);
  }
}

// Matter cut away from one channel, or by regions, is still in the bounds of the cells.
TEST(Clipping, OfDenseMatterCostsNoMoreThanItsAbsence) {
  const glm::ivec3 dims(16, 16, 16);
  const auto one = [](int, int, int) { return 1; };
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, one), channelOf<float>(dims, one));
  for (const BlendMode blend : kBlends)
    for (const bool regions : {false, true}) {
      Scene scene = frontScene(*volume, 8, 8);
      scene.blend = blend;
      scene.channels = {solid(1e6, kRed), solid(0.05, kBlue)};
      // Only a layer of four voxels at the far end remains of the dense channel.
      if (regions)
        scene.crop = Crop{{-0.5, -0.5, 11.5}, {7.5, 15.5, 15.5}, 0x7ffffffu & ~(7u | 7u << 3 | 7u << 6)};
      else
        scene.clip = {{{0, 0, 11.5}, {0, 0, 1}, std::vector<int>{0}}};
      for (const Method method : kTrackers) {
        const RenderStats stats = statsOf(volume, scene, method, 4);
        EXPECT_EQ(stats.truncatedRays, 0u) << nameOf(method) << ' ' << nameOf(blend);
        // One or two draws for every channel and span, and none in the parts cut away.
        EXPECT_LT(stats.randomBlocks, 8 * stats.rays) << nameOf(method) << ' ' << nameOf(blend);
      }
      expectTrackersMatchReference(volume, scene, 200, 1);
    }
}

// A shadow ray along the clip plane on which it begins intersects the matter on the kept side.
TEST(Clipping, LeavesNoLightThroughWhatLiesAlongAFace) {
  const glm::ivec3 dims(8, 8, 16);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  for (const int kind : {0, 1, 2})
    for (const Method method : kAllMethods) {
      Scene scene = frontScene(*volume, 8, 8);
      scene.shadows = true;
      scene.method = method;
      scene.channels = {solid(1e5, kWhite)};
      scene.channels[0].material.ambient = 0;
      scene.lights = {{LightType::directional, {1, 0, 0}, {1, 1, 1}, 1}};
      if (kind == 0) scene.crop = Crop{{-0.5, -0.5, 10.3}, {7.5, 7.5, 15.5}, Crop::kInnermost};
      if (kind == 1) scene.clip = {{{0, 0, 10.3}, {0, 0, 1}, {}}};
      if (kind == 2) {
        scene.clip = {{{0, 0, 10.3}, {-0.3, 0.2, 1}, {}}};
        scene.lights[0].vector = {1, 0, 0.3};
      }
      const Image picture = renderAnalog(volume, scene, method, 64);
      double sum = 0;
      for (int row = 0; row < 8; ++row)  // except the column that the light reaches
        for (int column = 1; column < 7; ++column) sum += picture.pixels[std::size_t(8 * row + column)].r;
      // The transmittance of quadrature is 1 - (1 - exp(-depth)), in float.
      EXPECT_LE(sum, hasStep(method) || method == Method::automatic ? 48 * 0x1p-24 : 0)
          << nameOf(method) << " face " << kind;
    }
}

TEST(Clipping, ByABoxKeepsTheVolumesOwnFaces) {
  const glm::ivec3 dims(9, 9, 9);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  Scene scene = frontScene(*volume, 2, 2);
  scene.camera.orthoHeight = 2 * 9;  // rays along the faces
  scene.filter = PixelFilter::point;
  scene.channels = {solid(10, kRed)};
  scene.crop = Crop{{-0.5, -0.5, 3}, {8.5, 8.5, 6}, Crop::kInnermost};
  const auto reference = reference::renderReference(*volume, scene, 1).image;
  for (const Method method : kAllMethods) {
    const Image found = renderAnalog(volume, scene, method, 4);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_GT(reference.pixels[i].a, 0.9f);
      EXPECT_NEAR(found.pixels[i].a, reference.pixels[i].a, 1e-4) << nameOf(method);
    }
  }
}

struct Cut {
  const char* name;
  std::function<void(Scene&, const Grid&)> apply;
};

glm::dvec3 worldAt(const Grid& grid, const glm::dvec3& share) {
  return glm::dvec3(grid.worldFromVoxel * glm::dvec4(share * glm::dvec3(grid.dims) - 0.5, 1));
}

const Cut kCuts[] = {
    {"Oblique",
     [](Scene& scene, const Grid& grid) {
       scene.clip = {{worldAt(grid, {0.45, 0.5, 0.55}), {0.3, -1, 0.6}, {}}};
     }},
    {"OfOneChannel",
     [](Scene& scene, const Grid& grid) {
       scene.clip = {{worldAt(grid, {0.5, 0.5, 0.5}), {1, 0.2, 0.1}, std::vector<int>{0}}};
     }},
    {"OfAllAndOfSome",
     [](Scene& scene, const Grid& grid) {
       scene.clip = {{worldAt(grid, {0.5, 0.5, 0.4}), {0.1, 0.3, 1}, {}},
                     {worldAt(grid, {0.6, 0.5, 0.5}), {-1, 0.5, 0}, std::vector<int>{1}},
                     {worldAt(grid, {0.5, 0.5, 0.5}), {0, -1, 0.2}, std::vector<int>{0, 1}}};
     }},
    {"Box",
     [](Scene& scene, const Grid& grid) {
       const glm::dvec3 size(grid.dims);
       scene.crop = Crop{glm::floor(0.3 * size), 0.8 * size, Crop::kInnermost};
     }},
    {"Regions",
     [](Scene& scene, const Grid& grid) {
       const glm::dvec3 size(grid.dims);
       scene.crop = Crop{0.3 * size, glm::floor(0.7 * size), 0x5a3c96bu};
     }},
    {"RegionsAndPlanes",
     [](Scene& scene, const Grid& grid) {
       const glm::dvec3 size(grid.dims);
       scene.crop = Crop{0.4 * size, 0.6 * size, 0x7ffffffu & ~Crop::kInnermost};
       scene.clip = {{worldAt(grid, {0.5, 0.5, 0.5}), {1, 1, 0.3}, std::vector<int>{0}}};
     }},
};

class ClippedScenes : public testing::TestWithParam<int> {};

/// Pairs of cut and blend mode; scenes and lights alternate.
TEST_P(ClippedScenes, AreUnbiased) {
  const Cut& cut = kCuts[GetParam()];
  for (int blend = 0; blend < int(std::size(kBlends)); ++blend) {
    const int light = (blend + GetParam()) % int(std::size(kLightConfigurations));
    const TestScene which = (blend + GetParam()) % 2 ? TestScene::lumps : TestScene::figure3;
    auto made = *testScene(which);
    made.scene.blend = kBlends[blend];
    made.scene.shading = kLightConfigurations[light].shading;
    made.scene.shadows = kLightConfigurations[light].shadows;
    cut.apply(made.scene, made.volume->grid());
    SCOPED_TRACE(testing::Message() << kTestSceneNames[int(which)] << ' ' << nameOf(kBlends[blend]) << ' '
                                    << kLightConfigurations[light].name);
    const auto expected = reference::renderReference(*made.volume, made.scene, 1);
    for (const Method method : kTrackers)
      EXPECT_TRUE(haveMean(replicate(made.volume, made.scene, method), made.scene, expected))
          << nameOf(method);
  }
}

TEST_P(ClippedScenes, AreWhatQuadratureApproaches) {
  const Cut& cut = kCuts[GetParam()];
  for (const BlendMode blend : kBlends)
    for (const bool lit : {false, true}) {
      if (!allCombinations() && lit != ((int(blend) + GetParam()) % 2 == 0)) continue;
      auto made = *testScene(TestScene::lumps);
      made.scene.width = made.scene.height = 20;
      made.scene.blend = blend;
      made.scene.shading = made.scene.shadows = lit;
      made.scene.method = Method::raymarch;
      cut.apply(made.scene, made.volume->grid());
      const Image expected = reference::renderReference(*made.volume, made.scene, 1).image;
      const auto errorAt = [&](double step) {
        made.scene.step = step;
        return compareImages(renderSamples(made.volume, made.scene, lit ? 192 : 96), expected).rmse;
      };
      const double coarse = errorAt(1), fine = errorAt(0.1);
      EXPECT_LT(fine, coarse / 3) << nameOf(blend) << " lit " << lit;
      EXPECT_LT(fine, 1.5e-3) << nameOf(blend) << " lit " << lit;
    }
}

INSTANTIATE_TEST_SUITE_P(By, ClippedScenes, testing::Range(0, int(std::size(kCuts))),
                         [](const auto& tested) { return std::string(kCuts[tested.param].name); });

TEST(Clipping, OfAnisotropicTiltedVolumesMatchesTheReference) {
  const glm::ivec3 dims(9, 7, 8);
  Grid grid = gridOf(dims, {1, 3, 0.4}, {50, -20, 7});
  const glm::dmat4 tilt(glm::dvec4(0.8, 0.6, 0, 0), glm::dvec4(-0.6, 0.8, 0, 0), glm::dvec4(0.1, 0, 1, 0),
                        glm::dvec4(0, 0, 0, 1));
  grid.worldFromVoxel = tilt * grid.worldFromVoxel;
  const auto volume =
      volumeOf(grid, channelOf<float>(dims, lumps(0)), channelOf<std::uint16_t>(dims, lumps(2)));
  const glm::dvec3 centre = worldAt(grid, glm::dvec3(0.5));
  for (const Cut& cut : kCuts) {
    SCOPED_TRACE(cut.name);
    Scene scene = viewFrom(*volume, centre + glm::dvec3(20, -25, 18), centre, 40, 16);
    scene.channels = {ramp(0, 1, 0.4, kRed), ramp(0, 1, 0.4, kBlue)};
    cut.apply(scene, grid);
    expectReference(volume, scene, 200);
  }
}

}  // namespace
}  // namespace scolopax
