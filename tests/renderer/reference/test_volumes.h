// SPDX-License-Identifier: Apache-2.0
// Small volumes and appearances for which the tests of the reference compute the expected values.
#pragma once
#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::reference {

using VoxelFunction = std::function<double(int i, int j, int k)>;

inline Grid makeGrid(glm::ivec3 dims, glm::dvec3 spacing = glm::dvec3(1), glm::dvec3 origin = glm::dvec3(0)) {
  Grid grid;
  grid.dims = dims;
  for (int axis = 0; axis < 3; ++axis) {
    grid.worldFromVoxel[axis][axis] = spacing[axis];
    grid.worldFromVoxel[3][axis] = origin[axis];
  }
  return grid;
}

/// One f32 channel per function.
inline Volume makeVolume(const Grid& grid, const std::vector<VoxelFunction>& functions) {
  std::vector<ChannelSource> channels;
  for (const VoxelFunction& f : functions) {
    ChannelSource channel;
    channel.voxels = VoxelBuffer(ScalarType::f32, grid.voxelCount());
    auto out = channel.voxels.as<float>().begin();
    for (int k = 0; k < grid.dims.z; ++k)
      for (int j = 0; j < grid.dims.y; ++j)
        for (int i = 0; i < grid.dims.x; ++i) *out++ = float(f(i, j, k));
    channels.push_back(std::move(channel));
  }
  return Volume(grid, std::move(channels));
}

/// Voxel (i,j,k) holds i.
inline Volume rampAlongX(glm::ivec3 dims, glm::dvec3 spacing = glm::dvec3(1),
                         glm::dvec3 origin = glm::dvec3(0)) {
  return makeVolume(makeGrid(dims, spacing, origin), {[](int i, int, int) { return i; }});
}

/// Extinction `density` everywhere, in one colour.
inline ChannelAppearance uniform(double density, glm::dvec3 color) {
  ChannelAppearance appearance;
  appearance.density = density;
  appearance.opacity = {{0, 1}};
  appearance.color = {{0, color}};
  return appearance;
}

/// Extinction rises from 0 at lo to `density` at hi, in one colour.
inline ChannelAppearance ramp(double lo, double hi, double density, glm::dvec3 color = glm::dvec3(1)) {
  ChannelAppearance appearance;
  appearance.rangeLo = lo;
  appearance.rangeHi = hi;
  appearance.density = density;
  appearance.color = {{0, color}};
  return appearance;
}

inline Scene makeScene(std::vector<ChannelAppearance> channels) {
  Scene scene;
  scene.channels = std::move(channels);
  return scene;
}

/// Figure 3 of the paper: three cubes with linear densities: red decreases along x, green along -x, blue
/// along -y.
struct Figure3 {
  static constexpr int n = 8;
  static constexpr double density = 0.9;
  Volume volume = makeVolume(makeGrid(glm::ivec3(n)),
                             {[](int i, int, int) { return n - 1 - i; }, [](int i, int, int) { return i; },
                              [](int, int j, int) { return j; }});
  Scene scene = makeScene({ramp(0, n - 1, density, {1, 0, 0}), ramp(0, n - 1, density, {0, 1, 0}),
                           ramp(0, n - 1, density, {0, 0, 1})});
  static glm::dvec3 sigma(const glm::dvec3& p) {
    const double x = std::clamp(p.x / (n - 1), 0.0, 1.0), y = std::clamp(p.y / (n - 1), 0.0, 1.0);
    return density * glm::dvec3(1 - x, x, y);
  }
};

}  // namespace scolopax::reference
