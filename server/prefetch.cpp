// SPDX-License-Identifier: Apache-2.0
#include "server/prefetch.h"

#include <algorithm>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/data/shared_macrocells.h"

namespace scolopax::server {

namespace {

/// Macrocells x channels beyond which the macrocells of a step are not built in advance, because they stay in
/// the memory of requests as long as the step's voxels are kept.
constexpr std::size_t kMostIntervals = 1 << 20;

}  // namespace

std::vector<std::size_t> stepsAround(std::size_t time, std::size_t times, bool backwards, std::size_t most) {
  std::vector<std::size_t> steps;
  const auto add = [&](std::size_t distance, bool back) {
    const std::size_t step = (time + (back ? times - distance : distance)) % times;
    if (step != time && steps.size() < most && std::ranges::find(steps, step) == steps.end())
      steps.push_back(step);
  };
  if (times < 2) return steps;
  // The one before comes after two that follow: whoever steps by hand may turn round.
  add(1, backwards);
  if (times > 2) add(2, backwards);
  add(1, !backwards);
  for (std::size_t distance = 3; distance < times && steps.size() < most; ++distance)
    add(distance, backwards);
  return steps;
}

Prefetch::Prefetch(std::shared_ptr<MemoryBudget> memory)
    : memory_(std::move(memory)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

Prefetch::~Prefetch() = default;

void Prefetch::around(const std::shared_ptr<const Dataset>& dataset, std::size_t time, int macrocell) {
  if (dataset->times() < 2 || !dataset->cache()) return;
  const std::lock_guard lock(mutex_);
  const auto isOfDataset = [&](const Request& request) { return request.dataset == dataset; };
  const auto last = std::ranges::find_if(shown_, isOfDataset);
  if (last != shown_.end() && last->time == time && last->macrocell == macrocell) return;
  Request request{dataset, time, macrocell, false};
  if (last != shown_.end()) {
    // The shorter way round is the direction of play.
    const std::size_t times = dataset->times(), ahead = (time + times - last->time) % times;
    request.backwards = ahead == 0 ? last->backwards : ahead > times / 2;
    shown_.erase(last);
  }
  std::erase_if(requests_, isOfDataset);
  shown_.push_back(request);
  requests_.push_back(std::move(request));
  came_.notify_all();
}

/// Whether a later request for the same data set waits.
bool Prefetch::replaced(const Request& request) {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(requests_, [&](const Request& r) { return r.dataset == request.dataset; });
}

void Prefetch::run(const std::stop_token& stop) {
  for (;;) {
    Request request;
    {
      std::unique_lock lock(mutex_);
      if (!came_.wait(lock, stop, [this] { return !requests_.empty(); })) return;
      request = std::move(requests_.front());
      requests_.pop_front();
    }
    try {
      load(request, stop);
    } catch (const std::exception&) {
    }
  }
}

void Prefetch::load(const Request& request, const std::stop_token& stop) {
  const Dataset& dataset = *request.dataset;
  VolumeCache& cache = *dataset.cache();
  const std::uint64_t bytes = std::max<std::uint64_t>(dataset.memoryBytes(), 1);
  // A quarter of the memory is left to others.
  const std::uint64_t fit = cache.limitBytes() / 4 * 3 / bytes;
  const auto steps = stepsAround(request.time, dataset.times(), request.backwards,
                                 std::size_t(std::min<std::uint64_t>(kMostSteps, fit > 0 ? fit - 1 : 0)));
  const std::uint64_t before = cache.uses() + 1;
  dataset.loaded(request.time);
  for (const std::size_t step : steps) dataset.loaded(step);
  for (const std::size_t step : steps) {
    if (stop.stop_requested() || replaced(request)) return;
    const auto wanted = dataset.wanted(step);
    const auto volume = cache.getIfRoom(wanted, before, stop);
    if (!volume) return;
    const std::size_t intervals =
        intervalCount(volume->grid().dims, volume->channels().size(), request.macrocell);
    if (intervals <= kMostIntervals)
      cache.attach(wanted.key, sharedMacrocells(volume, request.macrocell, stop, memory_));
  }
}

}  // namespace scolopax::server
