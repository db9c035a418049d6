// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/shared_macrocells.h"

#include "renderer/core/shared_builds.h"
#include "renderer/data/measuring.h"

namespace scolopax {
namespace {

struct Key {
  std::weak_ptr<const Volume> volume;  ///< distinguishes a new volume at an old address
  int size, channel;
};
struct KeyLess {
  bool operator()(const Key& a, const Key& b) const {
    if (a.size != b.size) return a.size < b.size;
    if (a.channel != b.channel) return a.channel < b.channel;
    return a.volume.owner_before(b.volume);
  }
};

std::size_t cellCount(const Volume& volume, int size) {
  return intervalCount(volume, size) / volume.channels().size();
}

}  // namespace

std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size,
                                                      const std::stop_token& stop,
                                                      const std::shared_ptr<MemoryBudget>& memory) {
  static SharedBuilds<Key, MacrocellGrid, KeyLess> builds;
  // While a channel is measured, the ends of its intervals are floats.
  const std::size_t bytes = intervalCount(*volume, size) * sizeof(kernel::LevelInterval) +
                            cellCount(*volume, size) * sizeof(ValueInterval);
  return builds.get({volume, size, 0},
                    measuring<MacrocellGrid>(memory, bytes,
                                             [volume, size](const std::stop_token& abandoned) {
                                               return buildMacrocells(*volume, size, abandoned);
                                             }),
                    stop);
}

std::shared_ptr<const GradientCells> sharedGradientCells(const std::shared_ptr<const Volume>& volume,
                                                         int channel, int size, const std::stop_token& stop,
                                                         const std::shared_ptr<MemoryBudget>& memory) {
  static SharedBuilds<Key, GradientCells, KeyLess> builds;
  const std::size_t bytes = cellCount(*volume, size) * (sizeof(std::uint8_t) + sizeof(ValueInterval));
  return builds.get({volume, size, channel},
                    measuring<GradientCells>(memory, bytes,
                                             [volume, channel, size](const std::stop_token& abandoned) {
                                               return buildGradientCells(*volume, channel, size, abandoned);
                                             }),
                    stop);
}

}  // namespace scolopax
