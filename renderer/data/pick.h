// SPDX-License-Identifier: Apache-2.0
// Picking: what is visible at a point of the picture. Chooses which pixels are sampled, and which sample
// represents a pixel. A backend takes the samples.
#pragma once
#include <atomic>
#include <chrono>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "renderer/kernel/sample_records.h"

namespace scolopax {

/// A rectangle of at least one pixel, inside the picture.
struct PixelArea {
  int left = 0, top = 0, width = 1, height = 1;
};

/// Most pixels that one pick samples.
inline constexpr int kMaxPickPixels = 1024;

/// The pixels of the area that are sampled, in reading order: all, or a regular lattice of them if there are
/// more than kMaxPickPixels.
std::vector<glm::ivec2> pixelsToPick(const PixelArea& area);

/// Side of the square of samples in each pixel: 8 for up to 64 pixels, 4 for up to 256, 2 for more. So one
/// pick never takes more than 4096 samples.
int pickSamplesSide(std::size_t pixels);
inline constexpr int kMaxPickSamplesSide = 8;

/// The sample that represents a pixel: among those that end in the channel in which most end (the first of
/// equals), the one of median depth (the nearer of two). None if fewer than one sample in sixteen has a
/// collision.
std::optional<std::size_t> visibleSample(std::span<const kernel::FirstCollision> samples);

/// What is visible at a pixel.
struct Picked {
  glm::dvec3 point;  ///< world space
  glm::dvec3 voxel;  ///< the same point in voxel coordinates
  int channel;       ///< of the volume
  double depth;      ///< world units from the eye, along the view direction
};

/// A pick in progress.
class Picking {
 public:
  virtual ~Picking() = default;
  /// Continues until all samples are taken and returns true, or returns false if `cancel` became true or
  /// `budget` ran out first. A cancel also ends a sample that takes long, which is then taken again. The
  /// budget is checked every few samples.
  virtual bool run(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) = 0;
  /// Number of samples taken so far.
  virtual std::size_t samples() const = 0;
  /// What is visible at pixelsToPick(), in their order, without pixels that show nothing. Call it after run()
  /// has returned true.
  virtual const std::vector<Picked>& found() const = 0;
};

}  // namespace scolopax
