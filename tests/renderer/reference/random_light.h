// SPDX-License-Identifier: Apache-2.0
// Small volumes, scenes and rays drawn at random, for comparisons of the reference with tiny steps.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "tests/renderer/reference/test_volumes.h"
#include "tests/support/gradients.h"

namespace scolopax::reference {

/// A volume and a scene in which everything that lighting depends on is random.
struct RandomLight {
  explicit RandomLight(unsigned seed) : random(seed) {}
  std::mt19937 random;
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
  bool chance(double p) { return unit() < p; }
  glm::dvec3 vector() { return {2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1}; }
  int among(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); }

  Volume volume() {
    glm::ivec3 dims;
    for (int axis = 0; axis < 3; ++axis) dims[axis] = chance(0.05) ? 1 : among(2, 5);
    Grid grid = gridOf(dims, {0.5 + unit(), 0.5 + unit(), 0.5 + unit()}, 10.0 * vector());
    if (chance(0.3)) grid.worldFromVoxel[0] += glm::dvec4(0.3 * vector(), 0);
    std::vector<ChannelSource> channels(std::size_t(among(1, 3)));
    for (ChannelSource& channel : channels) {
      const bool bytes = chance(0.5), smooth = chance(0.3), holes = chance(0.1);
      const glm::dvec3 slope = 40.0 * vector();
      channel.voxels = VoxelBuffer(bytes ? ScalarType::u8 : ScalarType::f32, grid.voxelCount());
      std::size_t i = 0;
      for (int z = 0; z < dims.z; ++z)
        for (int y = 0; y < dims.y; ++y)
          for (int x = 0; x < dims.x; ++x, ++i) {
            const double value =
                smooth ? std::clamp(100 + glm::dot(slope, glm::dvec3(x, y, z)), 0.0, 255.0) : 255 * unit();
            if (bytes)
              channel.voxels.as<std::uint8_t>()[i] = std::uint8_t(chance(0.3) ? 0 : value);
            else
              channel.voxels.as<float>()[i] =
                  holes && chance(0.1) ? std::numeric_limits<float>::quiet_NaN() : float(value);
          }
      channel.slope = 0.5;
      channel.intercept = -20;
    }
    return Volume(grid, std::move(channels));
  }

  ChannelAppearance appearance() {
    ChannelAppearance a;
    a.rangeLo = -20 + 60 * unit();
    a.rangeHi = chance(0.3) ? a.rangeLo + 10 * unit() : 107 - 30 * unit();  // steep or flat curves
    if (chance(0.2)) std::swap(a.rangeLo, a.rangeHi);
    a.gamma = chance(0.7) ? 1 : 0.4 + 2 * unit();
    a.density = std::pow(10, 1.5 * unit() - 1);
    a.weight = unit();
    const double shininess[] = {1, 0.5, 3, 20, 200, 5000};
    a.material = {unit(), unit(), chance(0.3) ? 0 : unit(), shininess[among(0, 5)]};
    a.opacity.clear();
    a.color.clear();
    for (int i = 0; i < 4; ++i) a.opacity.push_back({unit(), unit()});
    for (int i = 0; i < 2; ++i) a.color.push_back({unit(), {unit(), unit(), unit()}});
    std::sort(a.opacity.begin(), a.opacity.end(), [](auto& x, auto& y) { return x.position < y.position; });
    std::sort(a.color.begin(), a.color.end(), [](auto& x, auto& y) { return x.position < y.position; });
    if (chance(0.3)) a.opacity[2].position = a.opacity[1].position;
    return a;
  }

  /// Ranges within and around the channel's gradients; steps, reversed ranges and jumps.
  GradientOpacity factor(const Volume& volume, std::size_t channel) {
    const auto quantile = [&] { return test::gradientQuantile(volume, channel, unit()); };
    GradientOpacity opacity{quantile(), quantile(), {}};
    opacity.rangeLo *= chance(0.5) ? 1 : 0.1;
    opacity.rangeHi *= 1 + unit();
    if (chance(0.15)) opacity.rangeHi = opacity.rangeLo = opacity.rangeLo * (0.9 + 0.2 * unit());
    if (chance(0.2)) std::swap(opacity.rangeLo, opacity.rangeHi);
    for (int i = among(1, 5); i > 0; --i)
      opacity.factor.push_back({unit(), chance(0.3) ? among(0, 1) : unit()});
    std::sort(opacity.factor.begin(), opacity.factor.end(),
              [](const OpacityKnot& a, const OpacityKnot& b) { return a.position < b.position; });
    if (opacity.factor.size() > 2 && chance(0.5)) opacity.factor[1].position = opacity.factor[2].position;
    return opacity;
  }

  Scene scene(const Volume& volume) {
    Scene s;
    for (std::size_t n = 0; n < volume.channels().size(); ++n) s.channels.push_back(appearance());
    const BlendMode blends[] = {BlendMode::density, BlendMode::max, BlendMode::mix, BlendMode::composite};
    s.blend = blends[among(0, 3)];
    s.shading = true;
    const glm::dvec3 size = glm::dmat3(volume.grid().worldFromVoxel) * glm::dvec3(volume.grid().dims);
    for (int n = among(0, 3); n > 0; --n) {
      const LightType types[] = {LightType::directional, LightType::point, LightType::headlight};
      Light light{types[among(0, 2)], vector(), {unit(), unit(), unit()}, 0.4};
      if (light.type == LightType::point)  // inside the volume or near it
        light.vector = centre(volume) + size * light.vector;
      s.lights.push_back(light);
    }
    return s;
  }
  static glm::dvec3 centre(const Volume& volume) {
    return glm::dvec3(volume.grid().worldFromVoxel * glm::dvec4(0.5 * glm::dvec3(volume.grid().dims - 1), 1));
  }
};

/// A ray through the volume of `draw`; one in four starts inside.
struct RandomRay {
  glm::dvec3 origin, direction;
  RandomRay(RandomLight& draw, const Volume& volume, unsigned seed)
      : direction(glm::normalize(draw.vector())) {
    const glm::dmat3 worldFromVoxel(volume.grid().worldFromVoxel);
    const glm::dvec3 through =
        RandomLight::centre(volume) + worldFromVoxel * (0.4 * draw.vector() * glm::dvec3(volume.grid().dims));
    origin = through - (seed % 4 ? 10.0 : 0.0) * direction;
  }
};

}  // namespace scolopax::reference
