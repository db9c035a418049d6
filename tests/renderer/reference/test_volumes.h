// SPDX-License-Identifier: Apache-2.0
// Small volumes and appearances for which the tests of the reference compute the expected values, and rays
// through them.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/reference/integrator.h"
#include "tests/support/volumes.h"

namespace scolopax::reference {

using test::gridOf;
using test::ramp;
using test::solid;

inline constexpr Interpolation kInterpolations[] = {Interpolation::trilinear, Interpolation::cubic,
                                                    Interpolation::nearest};

inline constexpr glm::dvec3 kOrange(1, 0.5, 0.25);

using VoxelFunction = std::function<double(int i, int j, int k)>;

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
  return makeVolume(gridOf(dims, spacing, origin), {[](int i, int, int) { return i; }});
}

inline Scene makeScene(std::vector<ChannelAppearance> channels) {
  Scene scene;
  scene.channels = std::move(channels);
  return scene;
}

/// Nothing but these surfaces, over the range from 0 to 10.
inline ChannelAppearance surfaces(std::vector<Isovalue> isovalues, glm::dvec3 color = glm::dvec3(1)) {
  ChannelAppearance look = ramp(0, 10, 1, color);
  look.opacity = {{0, 0}};
  look.isovalues = std::move(isovalues);
  return look;
}

inline Light directional(const glm::dvec3& to, const glm::dvec3& color = glm::dvec3(1),
                         double intensity = 1) {
  return {LightType::directional, to, color, intensity};
}

/// The ray from x = -5 along the first row of voxels.
inline RayResult alongX(const Volume& volume, const Scene& scene) {
  return traceReference(volume, scene, {-5, 0, 0}, {1, 0, 0});
}

/// Optical depth along a ray, from its alpha.
inline double depthOf(const RayResult& ray) { return -std::log1p(-ray.rgba.a); }

inline void expectColor(const RayResult& found, const glm::dvec3& color, double alpha,
                        double tolerance = 1e-7) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.rgba[c], color[c], tolerance) << "component " << c;
  EXPECT_NEAR(found.rgba.a, alpha, tolerance);
  EXPECT_LE(found.error, 1e-6);
}

/// Figure 3 of the paper: three cubes with linear densities: red decreases along x, green along -x, blue
/// along -y.
struct Figure3 {
  static constexpr int n = 8;
  static constexpr double density = 0.9;
  Volume volume = makeVolume(gridOf(glm::ivec3(n)),
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
