// SPDX-License-Identifier: Apache-2.0
// Joint histogram of a channel's values and gradient magnitudes: for the page's plot, and for the default
// range of GradientOpacity. A pass over the volume, made when somebody first needs it.
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

/// Of the voxels themselves: nothing between their centres is looked at. The gradient is that of shading,
/// central differences of one voxel, one-sided at the border, along an axis of one voxel 0, in world space.
struct GradientHistogram {
  static constexpr std::size_t kBins = 256;  ///< of values and of |gradient|

  double maximum = 0;  ///< largest |gradient|, data units per world unit; 0 where there is none
  std::uint64_t finiteCount = 0;
  std::uint64_t nonFiniteCount = 0;  ///< voxels whose value or one of whose differences is NaN or infinite
  /// Per bin of values, which are those of the channel's Histogram, kBins of |gradient|, of equal widths over
  /// [0, maximum].
  std::vector<std::uint64_t> counts;
  /// Least and largest stored value in each bin of values; lo > hi where it has no voxels.
  std::vector<ValueInterval> stored;

  std::size_t sizeBytes() const {
    return counts.size() * sizeof(std::uint64_t) + stored.size() * sizeof(ValueInterval);
  }
  /// Counts of |gradient|, whatever the value.
  std::vector<std::uint64_t> bins() const;
};

/// Throws Error(cancelled) once `stop` is requested.
GradientHistogram measureGradientHistogram(const Volume& volume, int channel,
                                           const std::stop_token& stop = {});

/// The same, shared among all who ask for this channel while somebody holds it, and measured on threads of
/// its own. Waits; throws Error(cancelled) once `stop` is requested. Measuring ends when nobody waits for it.
/// Its memory is of `memory`, if that is given, which may refuse it: Error(busy, tooLarge).
std::shared_ptr<const GradientHistogram> sharedGradientHistogram(
    const std::shared_ptr<const Volume>& volume, int channel, const std::stop_token& stop = {},
    const std::shared_ptr<MemoryBudget>& memory = nullptr);

/// |gradient| below which the fraction p in [0,1] lies of those voxels that have opacity under a channel's
/// curve, by linear interpolation in its bin. Bins of values count whose least and largest value have
/// opacity; if there are none, those in which any value has; if there are none, all. 0 only where all is
/// flat. Throws Error(badInput) for a curve that cannot be rendered.
double gradientQuantile(const GradientHistogram& histogram, const Channel& channel,
                        const ChannelAppearance& look, double p);

}  // namespace scolopax
