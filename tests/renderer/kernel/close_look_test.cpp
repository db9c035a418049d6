// SPDX-License-Identifier: Apache-2.0
// The bounds that trackers compute from the voxels around a stretch of a ray hold, to the last bit, wherever
// a tentative collision can be tested.
#include "renderer/kernel/trackers/close_look.h"

#include <gtest/gtest.h>

#include <random>

#include "renderer/data/render_plan.h"
#include "tests/support/gradients.h"
#include "tests/support/volumes.h"

namespace scolopax::kernel {
namespace {

using namespace test;

std::vector<OpacityKnot> randomCurve(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double a = uniform(random) * 0.9, width = std::pow(10, -6 * uniform(random)) * 0.1;
  switch (random() % 4) {
    case 0:
      return {{0, 0}, {1, 1}};
    case 1:
      return {{a, 0}, {a, 1}, {a + width, 1}, {a + width, 0}};
    case 2:
      return {{a, 0}, {a + width / 2, 1}, {a + width, 0}};
    default:
      return {{0, 1}, {a, 1}, {a, 0.1}, {1, 0}};
  }
}

/// With `factors`, opacity also depends on the gradient.
template <class T>
void expectBounds(double largest, unsigned seed, bool factors = false) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  int short_ = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const glm::ivec3 dims(1 + int(random() % 6), 1 + int(random() % 6), 1 + int(random() % 6));
    const bool holes = trial % 5 == 0 && !std::is_integral_v<T>;
    const glm::dvec3 spacing = factors ? glm::dvec3(1, 0.4, 3) : glm::dvec3(1);
    const auto volume = volumeOf(gridOf(dims, spacing), channelOf<T>(dims, [&](int, int, int) {
                                   if (holes && random() % 8 == 0)
                                     return std::numeric_limits<double>::quiet_NaN();
                                   return random() % 3 == 0 ? 0.0 : largest * double(uniform(random));
                                 }));
    Scene scene = frontScene(*volume, 1, 1);
    ChannelAppearance& a = scene.channels[0];
    a.opacity = randomCurve(random);
    a.density = std::pow(10, 1 + 5 * double(uniform(random)));
    a.rangeLo = trial % 3 == 0 ? largest : 0;
    a.rangeHi = trial % 3 == 0 ? 0 : largest;
    a.gamma = trial % 7 == 0 ? 1.7 : 1;
    a.interpolation = Interpolation(trial / 4 % 3);
    if (factors) {
      const double lo = gradientQuantile(*volume, 0, 0.5 * double(uniform(random))),
                   hi = gradientQuantile(*volume, 0, double(uniform(random)));
      a.gradientOpacity = GradientOpacity{lo, hi, randomCurve(random)};
      if (trial % 2 == 0) a.opacity = {{0, 1}};
    }
    const RenderPlan plan(volume, scene);
    if (plan.view().channelCount == 0) continue;
    for (int i = 0; i < 20; ++i) {
      Ray ray{glm::vec3(dims) * glm::vec3(uniform(random), uniform(random), uniform(random)) - 0.5f,
              glm::vec3(uniform(random), uniform(random), uniform(random)) * 2.0f - 1.0f};
      if (random() % 3 == 0) ray.direction[int(random() % 3)] = 0;
      if (random() % 3 == 0) ray.origin = glm::vec3(glm::ivec3(ray.origin));  // on faces and edges
      const VoxelCell cell(plan.view(), ray, ray.origin);
      ASSERT_GT(cell.way, 0.0f);
      SampleCost cost;
      float way = std::min(cell.way, 4.0f);
      const float before = way;
      const float bound = boundAhead(plan.view(), 0, ray, cell, cell.inside(ray.origin), 1e-6f, &way, &cost);
      short_ += way < before;
      // If a voxel is not finite, points on a face of the cell may take their value from the cell beyond it.
      for (int k = holes ? 1 : 0; k <= (holes ? 63 : 64); ++k) {
        const float t = way * float(k) / 64.0f;
        const glm::vec3 point = cell.inside(ray.origin + t * ray.direction);
        ASSERT_LE(classify(plan.view(), 0, point, &cost).extinction, bound) << trial << " " << i << " " << k;
      }
    }
  }
  EXPECT_GT(short_, factors ? 100 : 300);  // includes stretches that end before the cell does
}

TEST(CloseLook, BoundsTheExtinctionOfIntegers) {
  expectBounds<std::uint8_t>(255, 1);
  expectBounds<std::int16_t>(30000, 2);
}
TEST(CloseLook, BoundsTheExtinctionOfFloats) {
  expectBounds<float>(1, 3);
  expectBounds<float>(1e-20, 4);
  expectBounds<float>(1e20, 5);
}

TEST(CloseLook, BoundsTheExtinctionByTheGradient) {
  expectBounds<std::uint8_t>(255, 6, true);
  expectBounds<std::int16_t>(30000, 7, true);
  expectBounds<float>(1, 8, true);
  expectBounds<float>(1e-20, 9, true);
  expectBounds<float>(1e20, 10, true);
}

TEST(CloseLook, NeedsNoShortStretchWhereNothingChanges) {
  const glm::ivec3 dims(4);
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int x, int, int) { return x < 2; }));
  Scene scene = frontScene(*volume, 1, 1);
  scene.channels[0].density = 1e9;
  const RenderPlan plan(volume, scene);
  for (const float x : {0.5f, 2.5f}) {
    const Ray ray{{x, 1, 1.25f}, {0, 0, 1}};
    const VoxelCell cell(plan.view(), ray, ray.origin);
    EXPECT_EQ(cell.way, 0.75f);
    SampleCost cost;
    float way = cell.way;
    EXPECT_EQ(boundAhead(plan.view(), 0, ray, cell, ray.origin, 1e-6f, &way, &cost), x < 1 ? 1e9f : 0.0f);
    EXPECT_EQ(way, 0.75f);
  }
}

}  // namespace
}  // namespace scolopax::kernel
