// SPDX-License-Identifier: Apache-2.0
// Joint histogram of a channel's values and gradient magnitudes, for the page's plot and for the default
// range of GradientOpacity. Takes two passes over the volume, made on first use.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"

namespace scolopax {

/// Counts voxels; nothing is interpolated between their centres. The gradient is that of shading, in world
/// space: central differences of one voxel, one-sided at the border, 0 along an axis of one voxel.
struct GradientHistogram {
  static constexpr std::size_t kBins = 256;  ///< of values and of |gradient|

  double maximum = 0;  ///< largest |gradient|, data units per world unit; 0 where there is none
  std::uint64_t finiteCount = 0;
  std::uint64_t nonFiniteCount = 0;  ///< voxels whose value or a difference is NaN or infinite
  /// kBins x kBins counts, |gradient| fastest. Value bins are those of the channel's Histogram; bins of
  /// |gradient| have equal widths over [0, maximum].
  std::vector<std::uint64_t> counts;
  /// Least and largest stored value in each value bin; lo > hi if the bin is empty.
  std::vector<ValueInterval> stored;

  std::size_t sizeBytes() const {
    return counts.size() * sizeof(std::uint64_t) + stored.size() * sizeof(ValueInterval);
  }
  /// Counts per bin of |gradient|, summed over all values.
  std::vector<std::uint64_t> bins() const;
};

/// Throws Error(cancelled) once `stop` is requested.
GradientHistogram measureGradientHistogram(const Volume& volume, int channel,
                                           const std::stop_token& stop = {});

/// The same, measured on threads of its own and shared by all callers that request this channel while one of
/// them holds the result. Waits for it; throws Error(cancelled) once `stop` is requested. Measuring stops
/// when no caller waits any more. The memory is charged to `memory`, if given; throws Error(busy) or
/// Error(tooLarge) if it refuses.
std::shared_ptr<const GradientHistogram> sharedGradientHistogram(
    const std::shared_ptr<const Volume>& volume, int channel, const std::stop_token& stop = {},
    const std::shared_ptr<MemoryBudget>& memory = nullptr);

/// |gradient| below which a fraction p in [0,1] of the visible voxels lies, interpolated linearly within its
/// bin. A value bin counts as visible if both its least and its largest stored value have opacity under the
/// channel's curve; if there is no such bin, if any value in it has; if there is none either, all bins count.
/// For p > 0 the result is 0 only if all gradients are 0. Throws Error(badInput) for a curve that cannot be
/// rendered.
double gradientQuantile(const GradientHistogram& histogram, const ChannelFacts& channel,
                        const ChannelAppearance& look, double p);

}  // namespace scolopax
