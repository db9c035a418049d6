// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/shared_macrocells.h"

#include <tbb/task_arena.h>

#include "renderer/core/shared_builds.h"
#include "renderer/core/thread_priority.h"

namespace scolopax {
namespace {

struct Key {
  std::weak_ptr<const Volume> volume;  ///< tells a new volume at an old address from the old one
  int size;
};
struct KeyLess {
  bool operator()(const Key& a, const Key& b) const {
    if (a.size != b.size) return a.size < b.size;
    return a.volume.owner_before(b.volume);
  }
};

}  // namespace

std::shared_ptr<const MacrocellGrid> sharedMacrocells(const std::shared_ptr<const Volume>& volume, int size,
                                                      const std::stop_token& stop,
                                                      const std::shared_ptr<MemoryBudget>& memory) {
  static SharedBuilds<Key, MacrocellGrid, KeyLess> builds;
  const int threads = tbb::this_task_arena::max_concurrency();  // as many as whoever asked first may have
  return builds.get(
      {volume, size},
      [volume, size, threads, memory](const std::stop_token& abandoned) {
        lowerThreadPriority();
        const std::size_t intervals = intervalCount(*volume, size),
                          cells = intervals / volume->channels().size();
        // While one channel is measured, the ends of its intervals are floats.
        auto share =
            MemoryBudget::take(memory, MemoryUse::grids,
                               intervals * sizeof(kernel::LevelInterval) + cells * sizeof(ValueInterval));
        MacrocellGrid grid;
        tbb::task_arena(threads, 1, tbb::task_arena::priority::low).execute([&] {
          grid = buildMacrocells(*volume, size, abandoned);
        });
        share.resize(grid.sizeBytes());
        return withShare(std::move(share), std::move(grid));
      },
      stop);
}

}  // namespace scolopax
