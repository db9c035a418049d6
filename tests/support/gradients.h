// SPDX-License-Identifier: Apache-2.0
// Gradient magnitudes of a channel, from which tests choose ranges for opacity by the gradient.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::test {

/// |gradient| at all voxels, ascending, in data units per world unit: central differences, one-sided at the
/// border. Voxels with a difference that is not finite are left out. `channel` is a Channel or a
/// ChannelSource.
template <class ChannelLike>
std::vector<double> gradientMagnitudes(const Grid& grid, const ChannelLike& channel) {
  const glm::ivec3 dims = grid.dims;
  const glm::dmat3 worldFromGradient = glm::transpose(glm::inverse(glm::dmat3(grid.worldFromVoxel)));
  std::vector<double> values;
  visitScalarType(channel.voxels.type(), [&](auto zero) {
    const auto voxels = channel.voxels.template as<decltype(zero)>();
    for (std::size_t i = 0; i < voxels.size(); ++i)
      values.push_back(channel.slope * double(voxels[i]) + channel.intercept);
  });
  std::vector<double> magnitudes;
  for (int z = 0; z < dims.z; ++z)
    for (int y = 0; y < dims.y; ++y)
      for (int x = 0; x < dims.x; ++x) {
        const glm::ivec3 at(x, y, z);
        glm::dvec3 perVoxel(0);
        for (int axis = 0; axis < 3; ++axis) {
          glm::ivec3 before = at, after = at;
          before[axis] = std::max(at[axis] - 1, 0);
          after[axis] = std::min(at[axis] + 1, dims[axis] - 1);
          const auto valueAt = [&](const glm::ivec3& p) {
            return values[std::size_t(p.x + dims.x * (p.y + dims.y * p.z))];
          };
          if (before != after)
            perVoxel[axis] = (valueAt(after) - valueAt(before)) / (after[axis] - before[axis]);
        }
        const double magnitude = glm::length(worldFromGradient * perVoxel);
        if (std::isfinite(magnitude)) magnitudes.push_back(magnitude);
      }
  std::sort(magnitudes.begin(), magnitudes.end());
  return magnitudes;
}

/// Quantile `share` of |gradient| over the voxels whose gradient is not 0; 1 if there are none.
inline double gradientQuantile(const Volume& volume, std::size_t channel, double share) {
  std::vector<double> found = gradientMagnitudes(volume.grid(), volume.channels()[channel]);
  found.erase(found.begin(), std::upper_bound(found.begin(), found.end(), 0.0));
  return found.empty() ? 1 : found[std::size_t(share * double(found.size() - 1))];
}

/// Opacity by the gradient, with a curve over a part of the range of the channel's gradients.
inline GradientOpacity factorBetween(const Volume& volume, std::size_t channel, double lowShare,
                                     double highShare, std::vector<OpacityKnot> factor = {{0, 0}, {1, 1}}) {
  return {gradientQuantile(volume, channel, lowShare), gradientQuantile(volume, channel, highShare),
          std::move(factor)};
}

}  // namespace scolopax::test
