// SPDX-License-Identifier: Apache-2.0
// Clip planes and crop regions as kernels read them. data/clip_view fills them; clip.h evaluates them.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>

namespace scolopax::kernel {

/// Points with dot(normal, point) + offset >= 0, in voxel coordinates, are kept.
struct ClipPlaneView {
  glm::vec3 normal;
  float offset;
  std::uint32_t channels;  ///< bit n: visible channel n is clipped
};
inline constexpr int kMaxClipPlanes = 8;
inline constexpr int kCropRegions = 27;

/// The part of the volume that clip planes and crop keep, in voxel coordinates. Everything outside the box
/// and behind the planes that clip all channels is cut away; inside, parts may be cut away, from some
/// channels or all.
struct ClipView {
  glm::vec3 low, high;
  int wholePlanes;  ///< number of leading planes that clip all channels
  int planeCount;
  ClipPlaneView planes[kMaxClipPlanes];
  bool parts;           ///< some planes clip only some channels, or the kept crop regions are not a box
  glm::vec3 cropAt[2];  ///< positions of the crop planes; infinite where they cut nothing off
  std::uint32_t regions[kCropRegions];  ///< (x, y, z) is at x + 3 y + 9 z: all bits set if kept, else 0
};

}  // namespace scolopax::kernel
