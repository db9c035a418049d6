// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/macrocell_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>

namespace scolopax {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();

/// Three nested interpolations round by at most 9 * 2^-24 of the largest value among their corners. An
/// interval of one value, and an end at zero, are exact: equal corners give no difference to round, and
/// rounding is monotone through zero.
ValueInterval widen(ValueInterval v) {
  if (!(v.lo < v.hi)) return v;
  const float slack = std::max(std::abs(v.lo), std::abs(v.hi)) * 0x1p-20f;
  if (v.lo != 0) v.lo -= slack;
  if (v.hi != 0) v.hi += slack;
  return v;
}

template <class T>
ValueInterval intervalOf(const T* voxels, glm::ivec3 dims, glm::ivec3 first, glm::ivec3 last) {
  ValueInterval v{kEmpty, -kEmpty};
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y) {
      const T* row = voxels + (std::size_t(z) * std::size_t(dims.y) + std::size_t(y)) * std::size_t(dims.x);
      for (int x = first.x; x <= last.x; ++x) {
        const float value = float(row[x]);
        if constexpr (std::is_same_v<T, float>)
          if (!std::isfinite(value)) continue;
        v.lo = std::min(v.lo, value);
        v.hi = std::max(v.hi, value);
      }
    }
  return widen(v);
}

}  // namespace

MacrocellGrid buildMacrocells(const Volume& volume, int size) {
  const glm::ivec3 dims = volume.grid().dims;
  MacrocellGrid grid;
  grid.size = size;
  // Cells lie between voxel centres: their support is size + 1 voxels an edge.
  for (int axis = 0; axis < 3; ++axis) grid.cells[axis] = std::max(1, (dims[axis] - 1 + size - 1) / size);
  const auto cells = glm::ivec3(grid.cells);
  const std::size_t count = std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z);
  for (const Channel& channel : volume.channels()) {
    std::vector<ValueInterval> intervals(count);
    visitScalarType(channel.voxels.type(), [&](auto zero) {
      const auto* voxels = channel.voxels.as<decltype(zero)>().data();
      tbb::parallel_for(0, cells.z, [&](int z) {
        std::size_t at = std::size_t(z) * std::size_t(cells.y) * std::size_t(cells.x);
        for (int y = 0; y < cells.y; ++y)
          for (int x = 0; x < cells.x; ++x) {
            const glm::ivec3 first = glm::ivec3(x, y, z) * size;
            const glm::ivec3 last = glm::min(first + size, dims - 1);
            intervals[at++] = intervalOf(voxels, dims, first, last);
          }
      });
    });
    grid.channels.push_back(std::move(intervals));
  }
  return grid;
}

std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size) {
  struct Entry {
    std::weak_ptr<const Volume> volume;  // tells a new volume at an old address from the old one
    std::weak_ptr<const MacrocellGrid> grid;
  };
  static std::mutex mutex;
  static std::map<std::pair<const Volume*, int>, Entry> entries;
  std::lock_guard lock(mutex);
  std::erase_if(entries, [](const auto& item) { return item.second.grid.expired(); });
  Entry& entry = entries[{volume.get(), size}];
  if (auto grid = entry.grid.lock(); grid && entry.volume.lock() == volume) return grid;
  auto grid = std::make_shared<const MacrocellGrid>(buildMacrocells(*volume, size));
  entry = {volume, grid};
  return grid;
}

}  // namespace scolopax
