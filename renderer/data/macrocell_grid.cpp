// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/macrocell_grid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "renderer/core/error.h"
#include "renderer/data/measuring.h"
#include "renderer/data/value_levels.h"

namespace scolopax {
namespace {

/// Three nested interpolations have a rounding error of at most 9 * 2^-24 times the largest magnitude of
/// their corners. An interval of one value, and an end at zero, are exact: equal corners give no difference
/// to round, and rounding is monotone through zero.
float slackFor(float largest) { return largest * 0x1p-20f; }

ValueInterval widen(ValueInterval v) {
  if (!(v.lo < v.hi)) return v;
  const float slack = slackFor(std::max(std::abs(v.lo), std::abs(v.hi)));
  if (v.lo != 0) v.lo -= slack;
  if (v.hi != 0) v.hi += slack;
  return v;
}

/// Calls visit(cell, interval) for every macrocell, from many threads. lo > hi where no voxel is finite.
template <class T, class Visit>
void measure(const StridedVoxels<T>& voxels, glm::ivec3 dims, const MacrocellGrid& grid,
             const std::stop_token& stop, Visit&& visit) {
  constexpr bool kFloat = std::is_same_v<T, float>;
  constexpr T kMost = kFloat ? std::numeric_limits<T>::infinity() : std::numeric_limits<T>::max();
  constexpr T kLeast = kFloat ? -std::numeric_limits<T>::infinity() : std::numeric_limits<T>::lowest();
  const std::size_t rowLength = std::size_t(dims.x);
  tbb::parallel_for(0, grid.cells.z, [&](int z) {
    std::vector<T> least(rowLength), most(rowLength);
    for (int y = 0; y < grid.cells.y; ++y) {
      checkWanted(stop);
      // Reduce all voxel rows of a row of macrocells to one: a long loop that vectorises.
      std::fill(least.begin(), least.end(), kMost);
      std::fill(most.begin(), most.end(), kLeast);
      for (int k = z * grid.size; k <= std::min((z + 1) * grid.size, dims.z - 1); ++k)
        for (int j = y * grid.size; j <= std::min((y + 1) * grid.size, dims.y - 1); ++j) {
          const T* row = &voxels[(std::size_t(k) * std::size_t(dims.y) + std::size_t(j)) * rowLength];
          for (std::size_t i = 0; i < rowLength; ++i) {
            const T value = row[i * voxels.stride];
            const bool counts = !kFloat || (value > kLeast && value < kMost);  // finite
            const T low = counts ? value : kMost, high = counts ? value : kLeast;
            least[i] = low < least[i] ? low : least[i];
            most[i] = high > most[i] ? high : most[i];
          }
        }
      std::size_t cell =
          (std::size_t(z) * std::size_t(grid.cells.y) + std::size_t(y)) * std::size_t(grid.cells.x);
      for (int x = 0; x < grid.cells.x; ++x, ++cell) {
        const int first = x * grid.size, last = std::min(first + grid.size, dims.x - 1);
        visit(cell, ValueInterval{
                        float(*std::min_element(&least[std::size_t(first)], &least[std::size_t(last)] + 1)),
                        float(*std::max_element(&most[std::size_t(first)], &most[std::size_t(last)] + 1))});
      }
    }
  });
}

}  // namespace

glm::ivec3 macrocellsOf(glm::ivec3 dims, int size) {
  return glm::max(glm::ivec3(1), (dims - 1 + size - 1) / size);
}

std::size_t intervalCount(const Volume& volume, int size) {
  const glm::ivec3 cells = macrocellsOf(volume.grid().dims, size);
  return std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z) * volume.channels().size();
}

MacrocellGrid buildMacrocells(const Volume& volume, int size, const std::stop_token& stop) {
  const glm::ivec3 dims = volume.grid().dims;
  MacrocellGrid grid;
  grid.size = size;
  grid.cells = macrocellsOf(dims, size);
  const std::size_t channels = volume.channels().size();
  grid.intervals.resize(grid.cellCount() * channels);
  for (std::size_t n = 0; n < channels; ++n) {
    const VoxelView& view = volume.channels()[n].voxels;
    visitScalarType(view.type(), [&](auto zero) {
      using T = decltype(zero);
      const StridedVoxels<T> voxels = view.as<T>();
      ValueLevels levels;
      if constexpr (std::is_same_v<T, std::uint8_t>) {
        for (int i = 0; i < kernel::kMaxLevels; ++i) levels.values.push_back(float(i));
        measure(voxels, dims, grid, stop, [&](std::size_t cell, ValueInterval v) {
          grid.intervals[cell * channels + n] = {std::uint8_t(v.lo), std::uint8_t(v.hi)};
        });
      } else {
        std::vector<ValueInterval> measured(grid.cellCount());
        measure(voxels, dims, grid, stop, [&](std::size_t cell, ValueInterval v) {
          measured[cell] = std::is_same_v<T, float> ? widen(v) : v;
        });
        checkWanted(stop);
        levels.values = chooseLevels(measured);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, measured.size(), 4096), [&](const auto& range) {
          checkWanted(stop);
          for (std::size_t cell = range.begin(); cell < range.end(); ++cell)
            grid.intervals[cell * channels + n] = encode(levels, measured[cell]);
        });
      }
      if constexpr (std::is_integral_v<T>)
        levels.slack = slackFor(std::max(std::abs(levels.values.front()), std::abs(levels.values.back())));
      grid.levels.push_back(std::move(levels));
    });
  }
  const CellBlocks blocks(grid.cells);
  grid.blocks.resize(blocks.count() * channels, {255, 0});
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.count(), 64), [&](const auto& range) {
    for (std::size_t block = range.begin(); block < range.end(); ++block)
      blocks.visitCells(block, [&](std::size_t cell) {
        for (std::size_t n = 0; n < channels; ++n) {
          kernel::LevelInterval& all = grid.blocks[block * channels + n];
          const kernel::LevelInterval one = grid.intervals[cell * channels + n];
          all = {std::min(all.lo, one.lo), std::max(all.hi, one.hi)};
        }
      });
  });
  return grid;
}

}  // namespace scolopax
