// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/shared_macrocells.h"

#include "renderer/core/shared_builds.h"
#include "renderer/data/measuring.h"

namespace scolopax {
namespace {

struct Key {
  std::weak_ptr<const Volume> volume;  ///< distinguishes a new volume at an old address
  int size, channel;
  bool spline;
};
struct KeyLess {
  bool operator()(const Key& a, const Key& b) const {
    if (a.size != b.size) return a.size < b.size;
    if (a.channel != b.channel) return a.channel < b.channel;
    if (a.spline != b.spline) return a.spline < b.spline;
    return a.volume.owner_before(b.volume);
  }
};

std::size_t cellCount(const Volume& volume, int size) {
  return countOf(macrocellsOf(volume.grid().dims, size));
}

}  // namespace

std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size,
                                                      const std::stop_token& stop,
                                                      const std::shared_ptr<MemoryBudget>& memory) {
  static SharedBuilds<Key, MacrocellGrid, KeyLess> builds;
  // While a channel is measured, the ends of its intervals are floats.
  const std::size_t bytes =
      intervalCount(volume->grid().dims, volume->channels().size(), size) * sizeof(kernel::LevelInterval) +
      cellCount(*volume, size) * sizeof(ValueInterval);
  return builds.get({volume, size, 0, false},
                    measuring<MacrocellGrid>(memory, bytes,
                                             [volume, size](const std::stop_token& abandoned) {
                                               return buildMacrocells(*volume, size, abandoned);
                                             }),
                    stop);
}

std::shared_ptr<const CellColumn> sharedSplineColumn(const std::shared_ptr<const Volume>& volume, int channel,
                                                     int size, const std::stop_token& stop,
                                                     const std::shared_ptr<MemoryBudget>& memory) {
  static SharedBuilds<Key, CellColumn, KeyLess> builds;
  const std::size_t bytes =
      cellCount(*volume, size) * (sizeof(kernel::LevelInterval) + sizeof(ValueInterval));
  return builds.get({volume, size, channel, true},
                    measuring<CellColumn>(memory, bytes,
                                          [volume, channel, size](const std::stop_token& abandoned) {
                                            return buildSplineColumn(*volume, channel, size, abandoned);
                                          }),
                    stop);
}

std::shared_ptr<const GradientCells> sharedGradientCells(const std::shared_ptr<const Volume>& volume,
                                                         int channel, int size, Interpolation interpolation,
                                                         const std::stop_token& stop,
                                                         const std::shared_ptr<MemoryBudget>& memory) {
  static SharedBuilds<Key, GradientCells, KeyLess> builds;
  const std::size_t bytes = cellCount(*volume, size) * (sizeof(std::uint8_t) + sizeof(ValueInterval));
  const auto make = [volume, channel, size, interpolation](const std::stop_token& abandoned) {
    return buildGradientCells(*volume, channel, size, interpolation, abandoned);
  };
  return builds.get({volume, size, channel, interpolation == Interpolation::cubic},
                    measuring<GradientCells>(memory, bytes, make), stop);
}

}  // namespace scolopax
