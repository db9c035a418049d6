// SPDX-License-Identifier: Apache-2.0
// What measurements of volumes have in common: they stop when nobody needs the result, and run beside
// rendering at low priority, few at once.
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <stop_token>
#include <thread>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/core/memory_budget.h"
#include "renderer/core/places.h"
#include "renderer/core/thread_priority.h"

namespace scolopax {

/// Throws Error(cancelled) once `stop` is requested.
inline void checkWanted(const std::stop_token& stop) {
  if (stop.stop_requested())
    throw Error(ErrorCode::cancelled, "measurement cancelled: its result is no longer needed");
}

/// Calls f(i) for every i below `count`, from many threads; `grain` calls are worth a task. Throws
/// Error(cancelled) soon after `stop` is requested.
template <class F>
void forEachOf(std::size_t count, std::size_t grain, const std::stop_token& stop, F&& f) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain), [&](const auto& range) {
    checkWanted(stop);
    for (std::size_t i = range.begin(); i < range.end(); ++i) f(i);
  });
}
/// Macrocells, and blocks of them with all their cells, that are worth a task.
inline constexpr std::size_t kManyCells = 4096, kManyBlocks = 64;

/// For all measurements of the process. Two on a single processor, so that a short one need not wait for a
/// long one.
inline Places& measuringPlaces() {
  static Places places(int(std::max(2u, std::thread::hardware_concurrency())));
  return places;
}

/// A SharedBuilds::Make that runs measure(stop) at low priority, on as many threads as the calling thread may
/// use, once there is a place for it. It charges `bytes` to the budget while it runs, then
/// result.sizeBytes().
template <class Result, class Measure>
auto measuring(const std::shared_ptr<MemoryBudget>& memory, std::size_t bytes, Measure measure) {
  const int threads = tbb::this_task_arena::max_concurrency();  // as many as the first requester may use
  return [=](const std::stop_token& abandoned) {
    lowerThreadPriority();
    const Places::Place place(measuringPlaces(), abandoned);
    auto share = MemoryBudget::take(memory, MemoryUse::grids, bytes);
    Result result;
    tbb::task_arena(threads, 1, tbb::task_arena::priority::low).execute([&] { result = measure(abandoned); });
    share.resize(result.sizeBytes());
    return withShare(std::move(share), std::move(result));
  };
}

}  // namespace scolopax
