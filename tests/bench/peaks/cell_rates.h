// SPDX-License-Identifier: Apache-2.0
// The sampling rate of every macrocell: by section 6.2 of Knoll et al. 2009, and by bounds of the error of
// linear interpolation.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"

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

/// For every macrocell, M such that only each M-th sample of a StepLaw is taken in it: M = 2 / m + 1, where m
/// is the standard deviation of the cell's voxels relative to that of all voxels. T(x) is not changed: every
/// x is a whole number, so the increments of Eq. 19 are not needed.
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

/// The largest slopes of a channel's extinction and emission, as functions of the value, between two values.
inline double largestSlope(const ChannelAppearance& look, double low, double high) {
  const double size = look.rangeHi - look.rangeLo;
  const auto positionOf = [&](double value) { return std::clamp((value - look.rangeLo) / size, 0.0, 1.0); };
  const double from = std::min(positionOf(low), positionOf(high)),
               to = std::max(positionOf(low), positionOf(high));
  const auto steepest = [&](const auto& knots, auto&& of) {
    double most = 0;
    for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
      if (knots[i + 1].position < from || knots[i].position > to) continue;
      const double change = of(knots[i], knots[i + 1]), way = knots[i + 1].position - knots[i].position;
      if (change > 0) most = std::max(most, way > 0 ? change / way : std::numeric_limits<double>::infinity());
    }
    return most;
  };
  double opaque = 0;
  for (const OpacityKnot& knot : look.opacity) opaque = std::max(opaque, knot.value);
  const double opacity =
      steepest(look.opacity, [](const auto& a, const auto& b) { return std::abs(b.value - a.value); });
  const double color = steepest(look.color, [](const auto& a, const auto& b) {
    const glm::dvec3 change = glm::abs(b.color - a.color);
    return std::max({change.x, change.y, change.z});
  });
  return look.density * (opacity + opaque * color) / std::abs(size);
}

/// For every macrocell, the number of steps of this length (world units) that may be taken at once: the
/// scalar is then assumed to be linear over a length h, which is wrong by up to h^2 / 8 times its second
/// derivative along the ray. That derivative is bounded by differences of voxels along the axes (the kinks at
/// the faces of cells), and by mixed differences, since f = xy has none along the axes. The error of the
/// extinction and emission over the length of a voxel is at most `tolerance`.
inline std::vector<int> boundedRates(const Channel& channel, const Grid& grid, int size,
                                     const ChannelAppearance& look, double step, double tolerance) {
  const glm::ivec3 dims = grid.dims, cells = macrocellsOf(dims, size);
  const double spacing = grid.smallestSpacing();
  constexpr double kMost = 1 << 20;
  std::vector<int> rates;
  visitScalarType(channel.voxels.type(), [&](auto zero) {
    const auto voxels = channel.voxels.as<decltype(zero)>();
    const auto at = [&](glm::ivec3 v) {
      v = glm::clamp(v, glm::ivec3(0), dims - 1);
      return channel.slope * double(voxels[(std::size_t(v.z) * std::size_t(dims.y) + std::size_t(v.y)) *
                                               std::size_t(dims.x) +
                                           std::size_t(v.x)]) +
             channel.intercept;
    };
    const auto rateOf = [&](glm::ivec3 low, glm::ivec3 high) {
      double least = std::numeric_limits<double>::infinity(), most = -least, along = 0, mixed = 0;
      for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
          for (int x = low.x; x <= high.x; ++x) {
            const glm::ivec3 v(x, y, z);
            const double value = at(v);
            least = std::min(least, value);
            most = std::max(most, value);
            for (int a = 0; a < 3; ++a) {
              glm::ivec3 i(0), j(0);
              i[a] = 1;
              j[(a + 1) % 3] = 1;
              along = std::max(along, std::abs(at(v + i) - 2 * value + at(v - i)));
              mixed = std::max(mixed, std::abs(at(v + i + j) - at(v + i) - at(v + j) + value));
            }
          }
      // Along a direction of length 1, squares of components add up to 1, and products of pairs to at most 1.
      const double curvature = (along + 2 * mixed) / (spacing * spacing);
      const double error = curvature / 8 * largestSlope(look, least, most) * spacing;  // times h^2
      if (!(error > 0)) return int(kMost);  // NaN: no curvature where a curve jumps
      return int(std::clamp(std::sqrt(tolerance / error) / step, 1.0, kMost));
    };
    for (int z = 0; z < cells.z; ++z)
      for (int y = 0; y < cells.y; ++y)
        for (int x = 0; x < cells.x; ++x) {
          const glm::ivec3 low = glm::ivec3(x, y, z) * size;
          rates.push_back(rateOf(low, glm::min(low + size, dims - 1)));
        }
  });
  return rates;
}

}  // namespace scolopax::peaks
