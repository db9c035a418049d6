// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/macrocell_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "renderer/core/error.h"
#include "renderer/data/measuring.h"
#include "renderer/data/value_levels.h"
#include "renderer/kernel/filters.h"

namespace scolopax {
namespace {

/// By how much rounding may carry a sample beyond the voxels it is between, the largest magnitude of which is
/// `largest`. An interval of one value, and an end at zero, are exact: equal voxels give no difference to
/// round, and rounding is monotone through zero.
float slackFor(float largest, kernel::Filter filter) { return largest * kernel::roundingOf(filter); }

ValueInterval widen(ValueInterval v, kernel::Filter filter) {
  if (!(v.lo < v.hi)) return v;
  const float slack = slackFor(std::max(std::abs(v.lo), std::abs(v.hi)), filter);
  if (v.lo != 0) v.lo -= slack;
  if (v.hi != 0) v.hi += slack;
  return v;
}

/// Macrocells to measure: their size in voxels, their number per axis, and how samples are interpolated.
struct Cells {
  int size;
  glm::ivec3 count;
  kernel::Filter filter;
};

/// Calls visit(cell, interval) for every macrocell, from many threads. lo > hi where no voxel is finite.
template <class T, class Visit>
void measure(const StridedVoxels<T>& voxels, glm::ivec3 dims, const Cells& cells, const std::stop_token& stop,
             Visit&& visit) {
  constexpr bool kFloat = std::is_same_v<T, float>;
  constexpr T kMost = kFloat ? std::numeric_limits<T>::infinity() : std::numeric_limits<T>::max();
  constexpr T kLeast = kFloat ? -std::numeric_limits<T>::infinity() : std::numeric_limits<T>::lowest();
  const std::size_t rowLength = std::size_t(dims.x);
  const int around = cells.filter == kernel::Filter::cubic ? 1 : 0;  // voxels that are read beyond the cell
  const auto first = [&](int cell) { return std::max(cell * cells.size - around, 0); };
  const auto last = [&](int cell, int axis) {
    return std::min((cell + 1) * cells.size + around, dims[axis] - 1);
  };
  tbb::parallel_for(0, cells.count.z, [&](int z) {
    std::vector<T> least(rowLength), most(rowLength);
    for (int y = 0; y < cells.count.y; ++y) {
      checkWanted(stop);
      // Reduce all voxel rows of a row of macrocells to one: a long loop that vectorises.
      std::fill(least.begin(), least.end(), kMost);
      std::fill(most.begin(), most.end(), kLeast);
      for (int k = first(z); k <= last(z, 2); ++k)
        for (int j = first(y); j <= last(y, 1); ++j) {
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
          (std::size_t(z) * std::size_t(cells.count.y) + std::size_t(y)) * std::size_t(cells.count.x);
      for (int x = 0; x < cells.count.x; ++x, ++cell) {
        const auto from = std::size_t(first(x)), to = std::size_t(last(x, 0));
        visit(cell, ValueInterval{float(*std::min_element(&least[from], &least[to] + 1)),
                                  float(*std::max_element(&most[from], &most[to] + 1))});
      }
    }
  });
}

/// Measures a channel. Calls put(cell, interval) for every macrocell, from many threads, and returns the
/// levels.
template <class Put>
ValueLevels measureChannel(const VoxelView& view, glm::ivec3 dims, const Cells& cells,
                           const std::stop_token& stop, Put&& put) {
  return visitScalarType(view.type(), [&](auto zero) {
    using T = decltype(zero);
    const StridedVoxels<T> voxels = view.as<T>();
    ValueLevels levels;
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      for (int i = 0; i < kernel::kMaxLevels; ++i) levels.values.push_back(float(i));
      measure(voxels, dims, cells, stop, [&](std::size_t cell, ValueInterval v) {
        put(cell, kernel::LevelInterval{std::uint8_t(v.lo), std::uint8_t(v.hi)});
      });
    } else {
      std::vector<ValueInterval> measured(countOf(cells.count));
      measure(voxels, dims, cells, stop, [&](std::size_t cell, ValueInterval v) {
        measured[cell] = std::is_same_v<T, float> ? widen(v, cells.filter) : v;
      });
      checkWanted(stop);
      levels.values = chooseLevels(measured);
      forEachOf(measured.size(), kManyCells, stop,
                [&](std::size_t cell) { put(cell, encode(levels, measured[cell])); });
    }
    if constexpr (std::is_integral_v<T>)
      levels.slack =
          slackFor(std::max(std::abs(levels.values.front()), std::abs(levels.values.back())), cells.filter);
    return levels;
  });
}

}  // namespace

glm::ivec3 macrocellsOf(glm::ivec3 dims, int size) {
  return glm::max(glm::ivec3(1), (dims - 1 + size - 1) / size);
}

std::size_t intervalCount(glm::ivec3 dims, std::size_t channels, int size) {
  return countOf(macrocellsOf(dims, size)) * channels;
}

MacrocellGrid buildMacrocells(const Volume& volume, int size, const std::stop_token& stop) {
  const glm::ivec3 dims = volume.grid().dims;
  MacrocellGrid grid;
  grid.size = size;
  grid.cells = macrocellsOf(dims, size);
  const std::size_t channels = volume.channels().size();
  grid.intervals.resize(grid.cellCount() * channels);
  for (std::size_t n = 0; n < channels; ++n)
    grid.levels.push_back(measureChannel(
        volume.channels()[n].voxels, dims, {size, grid.cells, kernel::Filter::trilinear}, stop,
        [&](std::size_t cell, kernel::LevelInterval v) { grid.intervals[cell * channels + n] = v; }));
  const CellBlocks blocks(grid.cells);
  grid.blocks.resize(blocks.count() * channels, {255, 0});
  forEachOf(blocks.count(), kManyBlocks, stop, [&](std::size_t block) {
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

CellColumn buildSplineColumn(const Volume& volume, int channel, int size, const std::stop_token& stop) {
  const glm::ivec3 dims = volume.grid().dims;
  const Cells cells{size, macrocellsOf(dims, size), kernel::Filter::cubic};
  CellColumn column;
  column.cells.resize(countOf(cells.count));
  column.levels = measureChannel(volume.channels()[std::size_t(channel)].voxels, dims, cells, stop,
                                 [&](std::size_t cell, kernel::LevelInterval v) { column.cells[cell] = v; });
  return column;
}

}  // namespace scolopax
