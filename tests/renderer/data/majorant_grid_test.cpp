// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/majorant_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "renderer/kernel/classify.h"
#include "renderer/kernel/sample_volume.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

std::vector<OpacityKnot> randomCurve(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<OpacityKnot> knots;
  const int count = 1 + int(uniform(random) * 8);
  for (int i = 0; i < count; ++i)
    knots.push_back({uniform(random), uniform(random) < 0.4 ? 0 : uniform(random)});
  std::sort(knots.begin(), knots.end(), [](auto& a, auto& b) { return a.position < b.position; });
  if (uniform(random) < 0.5) {  // a box: two jumps
    const double a = uniform(random) * 0.5, b = a + uniform(random) * 0.01;
    knots = {{0, 0}, {a, 0}, {a, 1}, {b, 1}, {b, 0}, {1, 0}};
  } else if (uniform(random) < 0.5) {  // near-Dirac
    const double a = uniform(random) * 0.99;
    knots = {{0, 0}, {a, 0}, {a + 5e-6, 1}, {a + 1e-5, 0}, {1, 0}};
  }
  return knots;
}

/// Every point that a tracker can fetch for a cell: corners, faces and the inside.
template <class T, class F>
void expectBound(F&& value, glm::ivec3 dims, double rangeLo, double rangeHi, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  const auto volume = volumeOf(gridOf(dims), channelOf<T>(dims, value));
  const Channel& channel = volume->channels()[0];
  for (const int size : {1, 2, 3, 4, 7, 16}) {
    const MacrocellGrid cells = buildMacrocells(*volume, size);
    for (int trial = 0; trial < 12; ++trial) {
      ChannelAppearance a;
      a.opacity = randomCurve(random);
      a.rangeLo = rangeLo;
      a.rangeHi = rangeHi;
      a.gamma = trial % 3 == 2 ? 0.5 + 2 * double(uniform(random)) : 1;
      a.density = 3.7;
      const TransferFunction transfer(channel, a);
      const std::vector<float> bounds = buildMajorants(cells.channels[0], transfer);
      const kernel::ChannelView view = transfer.view(channel);
      for (int sample = 0; sample < 4000; ++sample) {
        const glm::ivec3 cell(int(uniform(random) * float(cells.cells.x)),
                              int(uniform(random) * float(cells.cells.y)),
                              int(uniform(random) * float(cells.cells.z)));
        glm::vec3 p;
        for (int axis = 0; axis < 3; ++axis) {
          const float choice = uniform(random);  // often exactly on the cell's faces
          p[axis] = (float(cell[axis]) + (choice < 0.15f  ? 0
                                          : choice < 0.3f ? 1
                                                          : uniform(random))) *
                    float(size);
        }
        const float stored = kernel::sampleStored(view, dims, p);
        const float sigma =
            kernel::isFinite(stored) ? kernel::extinctionAt(view, kernel::curvePosition(view, stored)) : 0.0f;
        const std::size_t index = (std::size_t(cell.z) * std::size_t(cells.cells.y) + std::size_t(cell.y)) *
                                      std::size_t(cells.cells.x) +
                                  std::size_t(cell.x);
        ASSERT_LE(sigma, bounds[index]) << "size " << size << " trial " << trial << " gamma " << a.gamma;
      }
    }
  }
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForBytes) {
  std::mt19937 random(1);
  expectBound<std::uint8_t>([&](int, int, int) { return random() % 256; }, {13, 9, 11}, 0, 255, 2);
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForSignedWords) {
  std::mt19937 random(3);
  expectBound<std::int16_t>([&](int, int, int) { return int(random() % 65536) - 32768; }, {10, 7, 5}, -20000,
                            30000, 4);
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForFloatsFarFromZero) {
  std::mt19937 random(5);
  expectBound<float>([&](int, int, int) { return 280.0 + double(random() % 1000) * 1e-4; }, {9, 8, 7}, 280,
                     280.1, 6);
}

TEST(MajorantGrid, IsNeverBelowTheClassifiedValueForValuesThatAreNotFinite) {
  std::mt19937 random(7);
  expectBound<float>(
      [&](int, int, int) {
        switch (random() % 12) {
          case 0:
            return std::numeric_limits<float>::quiet_NaN();
          case 1:
            return std::numeric_limits<float>::infinity();
          case 2:
            return -std::numeric_limits<float>::infinity();
          case 3:
            return std::numeric_limits<float>::max();
          case 4:
            return -std::numeric_limits<float>::max();
          case 5:
            return 1e-40f;
          case 6:
            return -0.0f;
          default:
            return float(random() % 100) * 1e36f;
        }
      },
      {9, 8, 7}, -3e38, 3e38, 8);
}

TEST(MajorantGrid, IsZeroExactlyWhereNoSampleOfTheCellHasExtinction) {
  // One bright voxel in the middle: only the cells its interpolation reaches may be other than zero.
  const glm::ivec3 dims(17);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int x, int y, int z) {
                                 return x == 8 && y == 8 && z == 8 ? 255 : 0;
                               }));
  ChannelAppearance a;
  a.rangeHi = 255;
  const MacrocellGrid cells = buildMacrocells(*volume, 4);
  EXPECT_EQ(cells.cells, glm::ivec3(4));
  const std::vector<float> bounds =
      buildMajorants(cells.channels[0], TransferFunction(volume->channels()[0], a));
  int positive = 0;
  for (const float b : bounds) positive += b > 0;
  EXPECT_EQ(positive, 8);  // voxel 8 is the corner of eight cells
  EXPECT_EQ(*std::max_element(bounds.begin(), bounds.end()), 1.0f);
}

TEST(MajorantGrid, TakesTheKnotsInsideAnIntervalAndBothSidesOfAJump) {
  const glm::ivec3 dims(2, 1, 1);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<float>(dims, [](int x, int, int) { return float(x); }));
  ChannelAppearance a;
  const auto majorantOf = [&](std::vector<OpacityKnot> opacity, ValueInterval interval) {
    a.opacity = std::move(opacity);
    return TransferFunction(volume->channels()[0], a).majorant(interval);
  };
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 1}, {1, 0}}, {0.25f, 0.75f}), 1.0f);
  EXPECT_EQ(majorantOf({{0, 1}, {1, 0}}, {0.25f, 0.75f}), 0.75f);  // a falling ramp
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 0}, {0.5, 1}, {1, 0}}, {0.0f, 0.5f}), 1.0f);
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 0.8}, {0.5, 0}, {1, 0}}, {0.25f, 0.5f}), 0.8f);
  EXPECT_EQ(majorantOf({{0, 0}, {0.5, 0.8}, {0.5, 0}, {1, 0}}, {0.5f, 1.0f}), 0.0f);
  EXPECT_EQ(majorantOf({{0, 0}, {1, 1}}, {1.0f, 0.0f}), 0.0f);  // no finite sample
}

}  // namespace
}  // namespace scolopax
