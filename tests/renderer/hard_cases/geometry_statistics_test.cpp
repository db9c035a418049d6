// SPDX-License-Identifier: Apache-2.0
// Shapes of volumes, world transforms and cameras that lose precision or hit special cases of the traversal.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/renderer/hard_cases/hard_scenes.h"

namespace scolopax {
namespace {

using namespace test;

/// Two lumpy channels, red and blue; `density` per world unit.
struct Lumpy {
  std::shared_ptr<const Volume> volume;
  double density = 0.5;

  explicit Lumpy(const Grid& grid, double perWorldUnit = 0.5)
      : volume(volumeOf(grid, channelOf<float>(grid.dims, lumps(0)), channelOf<float>(grid.dims, lumps(3)))),
        density(perWorldUnit) {}
  std::vector<ChannelAppearance> channels() const {
    return {ramp(0, 1, density, kRed), ramp(0.2, 0.8, density, kBlue)};
  }
  void expectPerspective(glm::dvec3 eye, glm::dvec3 target, double fovY, int macrocell = 4) const {
    Scene scene = viewFrom(*volume, eye, target, fovY, kSide);
    scene.channels = channels();
    scene.macrocell = macrocell;
    SCOPED_TRACE(testing::Message() << eye.x << ' ' << eye.y << ' ' << eye.z);
    expectReference(volume, scene, kSamples);
  }
};

TEST(Shapes, OfASingleVoxelAreABox) {
  const auto volume = volumeOf(gridOf({1, 1, 1}, {2, 2, 5}),
                               channelOf<std::uint8_t>({1, 1, 1}, [](int, int, int) { return 9; }));
  Scene scene = frontScene(*volume, 24, 24);
  scene.channels[0] = solid(0.2, kRed);
  expectThickness(volume, scene, 1, kRed, 300);
  Scene view = viewFrom(*volume, {4, 3, -7}, {0, 0, 0}, 50, 24);
  view.channels = scene.channels;
  expectReference(volume, view, kSamples);
}

TEST(Shapes, OfOneVoxelLayersAndRowsMatchTheReference) {
  for (const glm::ivec3 dims : {glm::ivec3(1, 9, 12), glm::ivec3(9, 1, 12), glm::ivec3(9, 12, 1),
                                glm::ivec3(1, 1, 12), glm::ivec3(1, 12, 1), glm::ivec3(12, 1, 1)}) {
    const Lumpy lumpy(gridOf(dims));
    const glm::dvec3 centre = glm::dvec3(dims - 1) * 0.5;
    lumpy.expectPerspective(centre + glm::dvec3(14, 10, -17), centre, 35);
    for (int axis = 0; axis < 3; ++axis) {  // along the layer and across
      glm::dvec3 away(0);
      away[axis] = 20;
      lumpy.expectPerspective(centre + away, centre, 35);
    }
  }
}

TEST(Shapes, OfPrimeSizesMatchTheReferenceForMacrocellsThatDoNotDivideThem) {
  const Lumpy lumpy(gridOf({7, 13, 11}));
  for (const int macrocell : {1, 2, 3, 4, 5, 6, 7, 12, 64})
    lumpy.expectPerspective({20, 25, -15}, {3, 6, 5}, 32, macrocell);
}

TEST(Shapes, OfAnisotropicSpacingMatchTheReference) {
  // 1:1:100, with different axes as the long one; density is per world unit along any axis.
  for (const glm::dvec3 spacing : {glm::dvec3(1, 1, 100), glm::dvec3(100, 1, 1), glm::dvec3(1, 0.01, 1)}) {
    const Lumpy lumpy(gridOf({8, 8, 8}, spacing), 0.5 / std::min({spacing.x, spacing.y, 1.0}) / 4);
    const glm::dvec3 centre = 3.5 * spacing, size = 8.0 * spacing;
    lumpy.expectPerspective(centre + size * glm::dvec3(1.2, 0.9, -1.4), centre, 50);
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 away(0);
      away[axis] = size[axis];
      lumpy.expectPerspective(centre + away, centre, 30);
    }
  }
  const glm::ivec3 dims(4, 4, 6);
  const auto volume =
      volumeOf(gridOf(dims, {1, 1, 100}), channelOf<float>(dims, [](int, int, int) { return 1; }));
  Scene scene = frontScene(*volume, 16, 16);
  scene.channels[0] = solid(1e-3, kRed);
  expectThickness(volume, scene, 0.6, kRed, 300);
}

TEST(Worlds, OffsetByAMillionAndScaledByABillionLookTheSame) {
  for (const double scale : {1.0, 1e-9, 1e9})
    for (const double offset : {0.0, 1e6}) {
      const glm::dvec3 origin = offset * scale * glm::dvec3(1, -1, 1);
      const Lumpy lumpy(gridOf({9, 8, 7}, glm::dvec3(scale), origin), 0.5 / scale);
      lumpy.expectPerspective(origin + scale * glm::dvec3(18, 14, -11),
                              origin + scale * glm::dvec3(4, 3.5, 3), 32);
      Scene scene = frontScene(*lumpy.volume, kSide, kSide);
      scene.channels = lumpy.channels();
      expectReference(lumpy.volume, scene, kSamples);
    }
  const Lumpy large(gridOf({9, 8, 7}, glm::dvec3(1e9), glm::dvec3(1e6)), 0.5e-9);  // in world units
  large.expectPerspective({18e9, 14e9, -11e9}, {4e9, 3.5e9, 3e9}, 32);
}

TEST(Worlds, OffsetBeyondTheResolutionOfDoubleNumbersEndQuickly) {
  // Voxels of 1e-9 at 1e6: a tenth of a voxel is the last bit. Results cannot be right, but nothing may hang.
  const Lumpy lumpy(gridOf({9, 8, 7}, glm::dvec3(1e-9), glm::dvec3(1e6)), 0.5e9);
  Scene scene = frontScene(*lumpy.volume, 32, 32);
  scene.channels = lumpy.channels();
  for (const Method method : kTrackers) {
    const RenderStats stats = statsOf(lumpy.volume, scene, method, 4);
    EXPECT_EQ(stats.truncatedRays, 0u);
    EXPECT_LE(stats.cellSteps, stats.rays * 10);
  }
}

TEST(Worlds, SeenFromTenThousandBoxSizesAwayLookTheSame) {
  const Lumpy lumpy(gridOf({9, 8, 7}));
  const glm::dvec3 centre(4, 3.5, 3), direction = glm::normalize(glm::dvec3(0.7, 0.5, -0.6));
  const double distance = 1e4 * 9, fovY = 2 * std::atan(6 / distance) * 180 / 3.14159265358979323846;
  lumpy.expectPerspective(centre + distance * direction, centre, fovY);
  lumpy.expectPerspective(centre - glm::dvec3(0, 0, distance), centre, fovY);
}

TEST(Cameras, InsideOnFacesEdgesAndInCornersSeeWhatLiesBeforeThem) {
  const Lumpy lumpy(gridOf({9, 8, 7}));
  const glm::dvec3 centre(4, 3.5, 3);
  for (const glm::dvec3 eye : {glm::dvec3(4.2, 3.1, 2.7), glm::dvec3(4, 4, 4),     // inside, on cell planes
                               glm::dvec3(4.2, 3.1, -0.5), glm::dvec3(8.5, 4, 4),  // on a face
                               glm::dvec3(-0.5, 7.5, 2.2), glm::dvec3(8.5, 3.1, -0.5),      // on an edge
                               glm::dvec3(-0.5, -0.5, -0.5), glm::dvec3(8.5, 7.5, 6.5)}) {  // in a corner
    lumpy.expectPerspective(eye, eye + glm::dvec3(1, 0.4, 0.7), 70);
    lumpy.expectPerspective(eye, eye + glm::dvec3(0, 0, 1), 90);
    lumpy.expectPerspective(eye, 2.0 * centre - eye + glm::dvec3(0, 0, 0.1), 60);
  }
}

TEST(Cameras, OfAlmostAHalfTurnMatchTheReference) {
  const Lumpy lumpy(gridOf({9, 8, 7}));
  for (const glm::dvec3 eye : {glm::dvec3(4, 3.5, -0.55), glm::dvec3(4.2, 3.1, 2.7), glm::dvec3(4, 3.5, -30)})
    lumpy.expectPerspective(eye, {4.1, 3.4, 3}, 179);
  lumpy.expectPerspective({4, 3.5, -3e3}, {4.1, 3.4, 3}, 0.2);
}

TEST(Cameras, OfParallelRaysFromAllSidesMatchTheReference) {
  const Lumpy lumpy(gridOf({9, 8, 7}));
  const glm::dvec3 centre(4, 3.5, 3);
  for (const glm::dvec3 away :
       {glm::dvec3(0, 0, -20), glm::dvec3(0, 0, 20), glm::dvec3(20, 0, 0), glm::dvec3(-20, 0, 0),
        glm::dvec3(0, 20, 0), glm::dvec3(0, -20, 0),                           // two zero components
        glm::dvec3(14, 0, -13), glm::dvec3(0, -14, 13), glm::dvec3(9, 14, 0),  // one
        glm::dvec3(14, 10, -9)}) {
    Scene scene = viewFrom(*lumpy.volume, centre + away, centre, 35, kSide);
    scene.camera.up = away.y == 0   ? glm::dvec3(0, 1, 0)
                      : away.z == 0 ? glm::dvec3(0, 0, 1)
                                    : glm::dvec3(1, 0, 0);
    scene.camera.orthoHeight = 12;
    scene.channels = lumpy.channels();
    expectReference(lumpy.volume, scene, kSamples);
  }
}

TEST(Rays, ThroughVoxelCentresAndAlongMacrocellFacesMatchTheReference) {
  // The ray of pixel (i, j) runs along the voxels of column 7 - i and row 7 - j. Every 4th column or row lies
  // on a face between macrocells; where both do, the ray runs along an edge.
  const Lumpy lumpy(gridOf({8, 8, 8}));
  Scene scene = frontScene(*lumpy.volume, 8, 8);
  scene.channels = lumpy.channels();
  for (const int macrocell : {1, 2, 4}) {
    scene.macrocell = macrocell;
    expectReference(lumpy.volume, scene, 1000);
  }
}

TEST(Rays, ParallelToAFaceAtDistanceZeroAreInside) {
  // 4 x 4 pixels at -0.5, 1.5, 3.5 and 5.5: the outer rays run along faces of the box, those in the corners
  // along its edges.
  const glm::ivec3 dims(6, 6, 6);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int) { return 1; }));
  Scene scene = frontScene(*volume, 4, 4);
  scene.camera.orthoHeight = 8;
  scene.filter = PixelFilter::point;
  scene.channels[0] = solid(0.2, kRed);
  expectThickness(volume, scene, 1.2, kRed, 4000);
  const Lumpy lumpy(gridOf(dims));
  scene.channels = lumpy.channels();
  expectReference(lumpy.volume, scene, 2000);
}

TEST(Rays, GrazingAFaceMatchTheReference) {
  const Lumpy lumpy(gridOf({9, 8, 7}));
  for (const double above : {0.0, 1e-6, 1e-3, 0.1})  // above the face y = 7.5, at a grazing angle
    for (const double fall : {1e-3, 0.05}) {
      lumpy.expectPerspective({4, 7.5 + above, -6}, {4, 7.5 + above - fall, -5}, 6);
      lumpy.expectPerspective({4, 7.5 - above, -6}, {4, 7.5 - above + fall, -5}, 6);
    }
}

}  // namespace
}  // namespace scolopax
