// SPDX-License-Identifier: Apache-2.0
// Small volumes and scenes for tests.
#pragma once
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <type_traits>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::test {

/// The unbiased methods.
inline constexpr Method kTrackers[] = {Method::superposed, Method::cumulative, Method::syncDda, Method::nDda};
/// Every method but `automatic`, which chooses one of them.
inline constexpr Method kAllMethods[] = {Method::superposed, Method::cumulative, Method::syncDda,
                                         Method::nDda,       Method::raymarch,   Method::hybrid};
inline constexpr BlendMode kBlends[] = {BlendMode::density, BlendMode::max, BlendMode::mix,
                                        BlendMode::composite};

inline constexpr glm::dvec3 kRed(1, 0, 0), kGreen(0, 1, 0), kBlue(0, 0, 1), kWhite(1, 1, 1);

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// The largest float, and the smallest above 0.
inline constexpr double kLargest = std::numeric_limits<float>::max();
inline constexpr double kDenormal = std::numeric_limits<float>::denorm_min();

/// For samples that nobody cancels.
inline const std::atomic<bool> kNever = false;

/// Voxel (i,j,k) = value(i,j,k), rounded for integer types.
template <class T, class F>
ChannelSource channelOf(glm::ivec3 dims, F&& value, double slope = 1, double intercept = 0) {
  ChannelSource source;
  source.voxels =
      VoxelBuffer(scalarTypeOf<T>, std::size_t(dims.x) * std::size_t(dims.y) * std::size_t(dims.z));
  source.slope = slope;
  source.intercept = intercept;
  std::size_t at = 0;
  for (int z = 0; z < dims.z; ++z)
    for (int y = 0; y < dims.y; ++y)
      for (int x = 0; x < dims.x; ++x) {
        const auto v = value(x, y, z);
        if constexpr (std::is_integral_v<T>)
          source.voxels.template as<T>()[at++] = T(std::lround(double(v)));
        else
          source.voxels.template as<T>()[at++] = T(v);
      }
  return source;
}

inline Grid gridOf(glm::ivec3 dims, glm::dvec3 spacing = glm::dvec3(1), glm::dvec3 origin = glm::dvec3(0)) {
  Grid grid;
  grid.dims = dims;
  for (int axis = 0; axis < 3; ++axis) grid.worldFromVoxel[axis][axis] = spacing[axis];
  grid.worldFromVoxel[3] = glm::dvec4(origin, 1);
  return grid;
}

template <class... Sources>
std::shared_ptr<const Volume> volumeOf(const Grid& grid, Sources... sources) {
  std::vector<ChannelSource> list;
  (list.push_back(std::move(sources)), ...);
  return std::make_shared<const Volume>(grid, std::move(list));
}

/// A channel of opacity 1 at every value: its extinction is `density` wherever its samples are finite.
inline ChannelAppearance solid(double density, glm::dvec3 color = glm::dvec3(1)) {
  ChannelAppearance a;
  a.density = density;
  a.opacity = {{0, 1}};
  a.color = {{0, color}};
  return a;
}

/// Opacity rises from 0 at lo to 1 at hi.
inline ChannelAppearance ramp(double lo, double hi, double density, glm::dvec3 color = kWhite) {
  ChannelAppearance a;
  a.rangeLo = lo;
  a.rangeHi = hi;
  a.density = density;
  a.color = {{0, color}};
  return a;
}

/// Orthographic view along +z (towards increasing k) whose picture is exactly the box's cross-section, for
/// grids made by gridOf.
inline Scene frontScene(const Volume& volume, int width, int height) {
  Scene scene;
  const Grid& grid = volume.grid();
  const glm::dvec3 centre(grid.worldFromVoxel * glm::dvec4(glm::dvec3(grid.dims - 1) * 0.5, 1));
  scene.camera.target = centre;
  scene.camera.eye = centre - glm::dvec3(0, 0, grid.diagonal());
  scene.camera.up = {0, 1, 0};
  scene.camera.orthoHeight = double(grid.dims.y) * grid.spacing().y;
  scene.width = width;
  scene.height = height;
  scene.channels.resize(volume.channels().size());
  return scene;
}

}  // namespace scolopax::test
