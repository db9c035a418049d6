// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/macrocell_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "renderer/core/error.h"
#include "renderer/data/shared_macrocells.h"
#include "tests/support/orbitals.h"

namespace scolopax {
namespace {

using namespace test;

/// Smallest and largest finite voxel that interpolation in a cell may read, by plain loops over the cell.
ValueInterval voxelsOf(const Volume& volume, std::size_t channel, glm::ivec3 cell, int size) {
  const glm::ivec3 dims = volume.grid().dims;
  ValueInterval v{INFINITY, -INFINITY};
  visitScalarType(volume.channels()[channel].voxels.type(), [&](auto zero) {
    const auto voxels = volume.channels()[channel].voxels.template as<decltype(zero)>();
    for (int z = cell.z * size; z <= std::min((cell.z + 1) * size, dims.z - 1); ++z)
      for (int y = cell.y * size; y <= std::min((cell.y + 1) * size, dims.y - 1); ++y)
        for (int x = cell.x * size; x <= std::min((cell.x + 1) * size, dims.x - 1); ++x) {
          const float value = float(voxels[std::size_t((z * dims.y + y) * dims.x + x)]);
          if (!std::isfinite(value)) continue;
          v.lo = std::min(v.lo, value);
          v.hi = std::max(v.hi, value);
        }
  });
  return v;
}

/// Every cell's interval contains its voxels and ends at the nearest levels.
void expectNearestLevels(const Volume& volume, int size) {
  const MacrocellGrid grid = buildMacrocells(volume, size);
  for (std::size_t channel = 0; channel < volume.channels().size(); ++channel) {
    const ValueLevels& levels = grid.levels[channel];
    ASSERT_LE(levels.values.size(), 256u);
    std::vector<float> finite = levels.values;
    if (std::isnan(finite.back())) finite.pop_back();
    ASSERT_TRUE(std::is_sorted(finite.begin(), finite.end()));
    std::size_t index = 0;
    for (int z = 0; z < grid.cells.z; ++z)
      for (int y = 0; y < grid.cells.y; ++y)
        for (int x = 0; x < grid.cells.x; ++x, ++index) {
          const ValueInterval voxels = voxelsOf(volume, channel, {x, y, z}, size);
          const ValueInterval found = grid.interval(index, channel);
          ASSERT_EQ(voxels.lo <= voxels.hi, found.lo <= found.hi);
          if (!(voxels.lo <= voxels.hi)) continue;
          ASSERT_LE(found.lo, voxels.lo);
          ASSERT_GE(found.hi, voxels.hi);
          // No level is nearer to the voxels, except within rounding.
          const float slack = 2 * 0x1p-20f * std::max(std::abs(finite.front()), std::abs(finite.back()));
          const auto codes = grid.intervals[index * volume.channels().size() + channel];
          ASSERT_TRUE(codes.lo + 1u >= finite.size() || finite[codes.lo + 1u] > voxels.lo - slack);
          ASSERT_TRUE(codes.hi == 0 || finite[codes.hi - 1u] < voxels.hi + slack);
        }
  }
}

TEST(MacrocellGrid, EnclosesTheVoxelsBetweenTheNearestLevels) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const glm::ivec3 dims(19, 14, 11);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [&](int, int, int) { return random() % 256; }),
               channelOf<std::uint16_t>(dims, [&](int, int, int) { return random() % 65536; }),
               channelOf<std::int16_t>(dims, [&](int, int, int) { return int(random() % 7) - 3; }),
               channelOf<std::int16_t>(dims, [&](int, int, int) { return int(random() % 65536) - 32768; }),
               channelOf<float>(dims, [&](int, int, int) { return std::exp(3 * normal(random)) - 1; }),
               channelOf<float>(dims, [&](int x, int, int) {
                 return x < 9 || random() % 3 == 0 ? double(NAN)
                        : random() % 5 == 0        ? double(INFINITY)
                                                   : normal(random);
               }));
  for (const int size : {1, 2, 3, 4, 7, 32}) expectNearestLevels(*volume, size);
}

TEST(MacrocellGrid, KeepsEveryValueOfBytesAndOfChannelsWithFewValues) {
  std::mt19937 random(2);
  const glm::ivec3 dims(12, 11, 10);
  const auto label = [&](int, int, int) { return 1000 * int(random() % 30) - 9000; };
  const auto volume =
      volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [&](int, int, int) { return random() % 256; }),
               channelOf<std::int16_t>(dims, label));
  const MacrocellGrid grid = buildMacrocells(*volume, 2);
  std::size_t index = 0;
  for (int z = 0; z < grid.cells.z; ++z)
    for (int y = 0; y < grid.cells.y; ++y)
      for (int x = 0; x < grid.cells.x; ++x, ++index)
        for (std::size_t channel = 0; channel < 2; ++channel) {
          const ValueInterval voxels = voxelsOf(*volume, channel, {x, y, z}, 2);
          const auto codes = grid.intervals[index * 2 + channel];
          EXPECT_EQ(grid.levels[channel].values[codes.lo], voxels.lo);
          EXPECT_EQ(grid.levels[channel].values[codes.hi], voxels.hi);
        }
}

TEST(MacrocellGrid, GrowsNoIntervalByMoreThanAPartOfTheRangeAndFrequentValuesByNothing) {
  // Mostly empty background; a few voxels have values over six decades.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  const glm::ivec3 dims(64, 33, 33);
  const auto value = [&](int x, int, int) { return x < 40 ? 0.0 : std::pow(10.0, 6 * uniform(random)); };
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, value));
  const MacrocellGrid grid = buildMacrocells(*volume, 1);
  ASSERT_GT(grid.levels[0].values.size(), 128u);
  std::size_t index = 0, empty = 0, doubled = 0;
  for (int z = 0; z < grid.cells.z; ++z)
    for (int y = 0; y < grid.cells.y; ++y)
      for (int x = 0; x < grid.cells.x; ++x, ++index) {
        const ValueInterval voxels = voxelsOf(*volume, 0, {x, y, z}, 1), found = grid.interval(index, 0);
        EXPECT_LE(voxels.lo - found.lo, 1e6 / 127 * 1.001);
        EXPECT_LE(found.hi - voxels.hi, 1e6 / 127 * 1.001);
        if (voxels.hi == 0) {
          EXPECT_EQ(found.lo, 0);
          EXPECT_EQ(found.hi, 0);
          ++empty;
        } else {
          doubled += found.hi > 2 * voxels.hi;
        }
      }
  EXPECT_EQ(empty, 39u * 32 * 32);
  // The other half of the levels follows the density of the values; evenly spaced levels alone would double
  // most of the values.
  EXPECT_LT(doubled, (index - empty) / 50);
}

TEST(MacrocellGrid, IsNotMeasuredToTheEndWhenNobodyWantsIt) {
  const auto volume = orbitals();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(buildMacrocells(*volume, 4, stop.get_token()), Error);
  EXPECT_THROW(sharedMacrocells(volume, 4, stop.get_token()), Error);
}

TEST(MacrocellGrid, IsSharedByVolumeAndSizeWhileItIsHeld) {
  const auto volume = orbitals(), other = orbitals();
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(16) << 20);
  {
    const auto grid = sharedMacrocells(volume, 4, {}, memory);
    EXPECT_EQ(grid->intervals.size(), intervalCount(volume->grid().dims, volume->channels().size(), 4));
    EXPECT_EQ(memory->used(MemoryUse::grids), grid->sizeBytes());
    EXPECT_EQ(sharedMacrocells(volume, 4, {}, memory), grid);
    EXPECT_NE(sharedMacrocells(volume, 5, {}, memory), grid);
    EXPECT_NE(sharedMacrocells(other, 4, {}, memory), grid);
  }
  EXPECT_EQ(memory->used(MemoryUse::grids), 0u);
}

}  // namespace
}  // namespace scolopax
