// SPDX-License-Identifier: Apache-2.0
// Clip planes and crop of a scene; clip_view.h converts them for the kernels.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

namespace scolopax {

/// Keeps the points with dot(normal, x - point) >= 0, as VTK's clip functions do.
struct ClipPlane {
  glm::dvec3 point{0}, normal{0, 0, 1};      ///< world units; the normal has any length but 0
  std::optional<std::vector<int>> channels;  ///< indices in the volume; none: all
  bool operator==(const ClipPlane&) const = default;
};

/// Planes at `low` and `high` on each axis divide the volume into 27 regions, some of which are kept. A
/// region includes its lower plane and excludes its upper one. A plane at or beyond a face of the volume cuts
/// nothing off.
struct Crop {
  glm::dvec3 low, high;                ///< voxel coordinates, low <= high
  std::uint32_t regions = kInnermost;  ///< bit x + 3 y + 9 z: region (x, y, z) is kept
  static constexpr std::uint32_t kInnermost = 1u << 13;
  bool operator==(const Crop&) const = default;
};

}  // namespace scolopax
