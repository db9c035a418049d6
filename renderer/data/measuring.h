// SPDX-License-Identifier: Apache-2.0
// What measurements of volumes have in common: they end when nobody wants them, and run beside what renders.
#pragma once
#include <tbb/task_arena.h>

#include <cstddef>
#include <memory>
#include <stop_token>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/core/memory_budget.h"
#include "renderer/core/thread_priority.h"

namespace scolopax {

/// Throws Error(cancelled) once `stop` is requested.
inline void checkWanted(const std::stop_token& stop) {
  if (stop.stop_requested())
    throw Error(ErrorCode::cancelled, "what was to be measured is not wanted any more");
}

/// A SharedBuilds::Make that runs measure(stop) at low priority, on as many threads as this one may use.
/// `bytes` of the budget are its while it runs, then result.sizeBytes().
template <class Result, class Measure>
auto measuring(const std::shared_ptr<MemoryBudget>& memory, std::size_t bytes, Measure measure) {
  const int threads = tbb::this_task_arena::max_concurrency();  // as many as whoever asked first may have
  return [=](const std::stop_token& abandoned) {
    lowerThreadPriority();
    auto share = MemoryBudget::take(memory, MemoryUse::grids, bytes);
    Result result;
    tbb::task_arena(threads, 1, tbb::task_arena::priority::low).execute([&] { result = measure(abandoned); });
    share.resize(result.sizeBytes());
    return withShare(std::move(share), std::move(result));
  };
}

}  // namespace scolopax
