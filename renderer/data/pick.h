// SPDX-License-Identifier: Apache-2.0
// What is visible at a place of the picture: which pixels are looked at, and which of their samples tells
// what is seen there. A backend takes the samples.
#pragma once
#include <chrono>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "renderer/kernel/views.h"

namespace scolopax {

/// Pixels of a picture, at least one; none outside of it.
struct PixelArea {
  int left = 0, top = 0, width = 1, height = 1;
};

/// Pixels that one pick looks at, at most.
inline constexpr int kMaxPickPixels = 1024;

/// Those of the area that are looked at, in reading order: all, or a regular lattice of them.
std::vector<glm::ivec2> pixelsToPick(const PixelArea& area);

/// Samples lie in a square in each pixel: side of it, 8 for up to 64 pixels, 4 for up to 256, and 2. So there
/// are never more than 4096.
int pickSamplesSide(std::size_t pixels);
inline constexpr int kMaxPickSamplesSide = 8;

/// The sample of a pixel that tells what is visible there: of those that end in the channel in which most
/// end (of equal ones the first), the one of median depth (the nearer of two). None where fewer than one in
/// sixteen meets anything.
std::optional<std::size_t> visibleSample(std::span<const kernel::FirstCollision> samples);

/// What is visible at a pixel.
struct Picked {
  glm::dvec3 point;  ///< world space
  glm::dvec3 voxel;  ///< the same point in voxel coordinates
  int channel;       ///< of the volume
  double depth;      ///< world units from the eye, along the view direction
};

/// A pick on its way.
class Picking {
 public:
  virtual ~Picking() = default;
  /// Goes on until all samples are taken; false when the budget, which is looked at every few of them,
  /// was used up before.
  virtual bool run(std::chrono::nanoseconds budget) = 0;
  /// What is visible at pixelsToPick(), in their order, without those that show nothing; once run() has
  /// returned true.
  virtual const std::vector<Picked>& found() const = 0;
};

}  // namespace scolopax
