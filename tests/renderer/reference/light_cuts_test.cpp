// SPDX-License-Identifier: Apache-2.0
// Between two cuts no vector changes sides, and none rotates far: checked with gradients at points, on random
// lines through random voxels.
#include "renderer/reference/light_cuts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <random>

#include "tests/renderer/reference/test_volumes.h"

namespace scolopax::reference {
namespace {

/// One channel of random voxels in three lights, and rays through them.
struct Lines {
  std::mt19937 random;
  glm::ivec3 dims{4, 3, 5};
  glm::dmat3 worldFromVoxel;
  Volume volume;
  Scene scene;

  explicit Lines(unsigned seed, double shininess)
      : random(seed),
        worldFromVoxel(glm::dvec3(1, 0.1, 0), glm::dvec3(0, 1.5, 0.2), glm::dvec3(0.1, 0, 0.8)),
        volume(makeVolume(grid(), {[this](int, int, int) { return unit(); }})),
        scene(makeScene({solid(1, glm::dvec3(1))})) {
    scene.shading = true;
    scene.channels[0].interpolation = seed < 20 ? Interpolation::trilinear : Interpolation::cubic;
    scene.channels[0].rangeHi = 0.5;  // the fade saturates in places
    scene.channels[0].material = {0.1, 0.5, 0.5, shininess};
    scene.lights = {
        {LightType::directional, vector(), glm::dvec3(1), 1},
        {LightType::point, worldFromVoxel * (glm::dvec3(2, 1, 2) + 2.0 * vector()), glm::dvec3(1), 1},
        Light{}};
  }
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
  glm::dvec3 vector() { return {2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1}; }
  Grid grid() const {
    Grid g;
    g.dims = dims;
    g.worldFromVoxel = glm::dmat4(worldFromVoxel);
    return g;
  }

  struct Place {
    glm::dvec3 normal;
    double steepness;
    std::vector<double>
        sides;  // n.v, and n.l and n.h of every light, with the normal not flipped to the viewer
    std::vector<glm::dvec3> halves;
  };
  Place at(const ScalarField& field, const glm::dvec3& pointVoxel, const glm::dvec3& v) const {
    Place place;
    const glm::dvec3 gradient = glm::transpose(glm::inverse(worldFromVoxel)) * field.gradient(pointVoxel);
    place.normal = glm::normalize(gradient);
    place.steepness = glm::length(gradient) * volume.grid().spacing().z / 0.5;
    place.sides = {glm::dot(place.normal, v)};
    for (const Light& light : scene.lights) {
      glm::dvec3 l = v;
      if (light.type == LightType::directional) l = glm::normalize(-light.vector);
      if (light.type == LightType::point) l = glm::normalize(light.vector - worldFromVoxel * pointVoxel);
      place.halves.push_back(glm::normalize(l + v));
      place.sides.push_back(glm::dot(place.normal, l));
      place.sides.push_back(glm::dot(place.normal, place.halves.back()));
    }
    return place;
  }

  /// Calls visit(places) with several places between each two neighbouring cuts of a ray.
  template <class Visit>
  void forEachPiece(int rays, const Visit& visit) {
    const Lighting lighting(scene, glm::dvec3(0));
    const LightCuts lightCuts(lighting, worldFromVoxel, 1e-6);
    const ActiveChannel channel{0,
                                ScalarField(volume.channels()[0], dims, scene.channels[0].interpolation),
                                ChannelCurves(scene.channels[0]),
                                1,
                                false,
                                scene.channels[0].material,
                                0.5};
    for (int ray = 0; ray < rays; ++ray) {
      const glm::dvec3 direction = glm::normalize(vector());
      const glm::dvec3 through = glm::dvec3(unit(), unit(), unit()) * glm::dvec3(dims) - 0.5;
      const RayCells cells = cutAtCells(through, glm::inverse(worldFromVoxel) * direction, dims);
      forEachSmoothPart(
          cells, dims, Clipping(Scene(), volume.grid()), BlendMode::density, {&channel, 1},
          [&](const Stretch& stretch, double begin, double end) {
            const auto cuts = lightCuts.of(stretch, begin, end, direction);
            EXPECT_EQ(cuts.front(), begin);
            EXPECT_EQ(cuts.back(), end);
            for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
              EXPECT_LT(cuts[k], cuts[k + 1]);
              if (cuts[k + 1] - cuts[k] < 1e-5 * (end - begin)) continue;
              std::vector<Place> places;
              places.reserve(20);
              for (int i = 0; i < 20; ++i)
                places.push_back(at(channel.field,
                                    stretch.point(std::lerp(cuts[k], cuts[k + 1], (i + 0.5) / 20)),
                                    -direction));
              visit(places);
            }
            return true;
          });
    }
  }
};

TEST(LightCuts, NothingChangesSidesBetweenThem) {
  int pieces = 0, turned = 0;
  for (unsigned seed = 0; seed < 40; ++seed)
    Lines(seed, 2).forEachPiece(20, [&](const std::vector<Lines::Place>& places) {
      ++pieces;
      for (std::size_t side = 0; side < places[0].sides.size(); ++side) {
        double least = 1, most = -1;
        for (const Lines::Place& place : places) {
          least = std::min(least, place.sides[side]);
          most = std::max(most, place.sides[side]);
        }
        EXPECT_FALSE(least < -1e-9 && most > 1e-9) << "side " << side;
        turned += most < 0;
      }
      double least = 1e9, most = 0;
      for (const Lines::Place& place : places) {
        least = std::min(least, place.steepness);
        most = std::max(most, place.steepness);
      }
      EXPECT_FALSE(least < 1 - 1e-9 && most > 1 + 1e-9);
    });
  EXPECT_GT(pieces, 2000);
  EXPECT_GT(turned, 1000);
}

TEST(LightCuts, NormalsTurnLittleBetweenThem) {
  for (unsigned seed = 0; seed < 40; ++seed)
    Lines(seed, 2).forEachPiece(20, [&](const std::vector<Lines::Place>& places) {
      EXPECT_GT(glm::dot(places.front().normal, places.back().normal), std::cos(1.0) - 1e-9);
    });
}

TEST(LightCuts, AHighlightIsWiderThanThePieceThatHoldsIt) {
  constexpr double kShininess = 1e5;
  int bright = 0;
  for (unsigned seed = 0; seed < 40; ++seed)
    Lines(seed, kShininess).forEachPiece(20, [&](const std::vector<Lines::Place>& places) {
      for (std::size_t light = 0; light < 3; ++light)
        for (const Lines::Place& p : places) {
          if (!(std::pow(std::abs(glm::dot(p.normal, p.halves[light])), kShininess) > 1e-5)) continue;
          ++bright;
          // From end to end n and h rotate by two widths, sqrt(2 / shininess), to each side of the middle.
          EXPECT_GT(glm::dot(places.front().normal, places.back().normal),
                    std::cos(2 * std::sqrt(2 / kShininess)));
        }
    });
  EXPECT_GT(bright, 100);
}

TEST(LightCuts, AreNoneButTheEndsWhereLightDoesNotLookAtGradients) {
  Lines lines(1, 20);
  lines.scene.shading = false;
  lines.scene.shadows = true;
  lines.scene.lights.erase(lines.scene.lights.begin() + 1);
  const Lighting lighting(lines.scene, glm::dvec3(0));
  const LightCuts lightCuts(lighting, lines.worldFromVoxel, 1e-6);
  Stretch stretch;
  stretch.end = {1, 1, 1};
  EXPECT_EQ(lightCuts.of(stretch, 0.25, 0.75, {0, 0, 1}), (std::vector<double>{0.25, 0.75}));
}

}  // namespace
}  // namespace scolopax::reference
