// SPDX-License-Identifier: Apache-2.0
// The sampling rate of every macrocell, by section 6.2 of Knoll et al. 2009.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "renderer/data/macrocell_grid.h"

namespace scolopax::peaks {

/// Sum and sum of squares of some voxels.
struct Moments {
  double count = 0, sum = 0, squares = 0;
  void add(double value) {
    ++count;
    sum += value;
    squares += value * value;
  }
  double variance() const { return std::max(0.0, squares / count - (sum / count) * (sum / count)); }
};

/// For every macrocell, that only each M-th sample of a StepLaw is taken in it: M = 2 / m + 1, with m the
/// standard deviation of the cell's voxels relative to that of all voxels. T(x) stays as it is, for every x
/// is a whole number, so that Eq. 19's increments are not needed.
inline std::vector<int> cellRates(const Channel& channel, glm::ivec3 dims, int size) {
  const glm::ivec3 cells = macrocellsOf(dims, size);
  constexpr double kMost = 1 << 20;  // of a cell without variance; a step ends with its cell
  std::vector<int> rates;
  visitScalarType(channel.voxels.type(), [&](auto zero) {
    const auto voxels = channel.voxels.as<decltype(zero)>();
    const auto momentsOf = [&](glm::ivec3 low, glm::ivec3 high) {
      Moments moments;
      for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
          for (int x = low.x; x <= high.x; ++x)
            moments.add(
                double(voxels[(std::size_t(z) * std::size_t(dims.y) + std::size_t(y)) * std::size_t(dims.x) +
                              std::size_t(x)]));
      return moments;
    };
    const double whole = momentsOf(glm::ivec3(0), dims - 1).variance();
    for (int z = 0; z < cells.z; ++z)
      for (int y = 0; y < cells.y; ++y)
        for (int x = 0; x < cells.x; ++x) {
          const glm::ivec3 low = glm::ivec3(x, y, z) * size;
          const double m = std::sqrt(momentsOf(low, glm::min(low + size, dims - 1)).variance() / whole);
          rates.push_back(int(std::min(2 / m + 1, kMost)));
        }
  });
  return rates;
}

}  // namespace scolopax::peaks
