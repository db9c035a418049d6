// SPDX-License-Identifier: Apache-2.0
// Loads the steps of a time series that will probably be shown next, so that playing it does not wait for
// files. Used by ProgressiveRender.
#pragma once
#include <condition_variable>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "server/dataset.h"

namespace scolopax::server {

/// The steps to load after `time` has been shown, most urgent first: those that follow in the direction of
/// play, which begins again at the end, and the one before. At most `most` of them.
std::vector<std::size_t> stepsAround(std::size_t time, std::size_t times, bool backwards, std::size_t most);

class Prefetch {
 public:
  /// Steps that are loaded beyond the one that is shown, if there is memory.
  static constexpr std::size_t kMostSteps = 8;

  /// Memory for macrocells is charged to `memory`, if given.
  explicit Prefetch(std::shared_ptr<MemoryBudget> memory);
  ~Prefetch();
  Prefetch(const Prefetch&) = delete;
  Prefetch& operator=(const Prefetch&) = delete;

  /// A step of the data set is shown, with macrocells of this size. Loads those around it in the background,
  /// in place of those requested earlier for this data set. Only volumes that were last used before all of
  /// them give way. Errors are not reported: whoever asks for a step gets them. From any thread.
  void around(const std::shared_ptr<const Dataset>& dataset, std::size_t time, int macrocell);

 private:
  struct Request {
    std::shared_ptr<const Dataset> dataset;
    std::size_t time = 0;
    int macrocell = 0;
    bool backwards = false;
  };
  void run(const std::stop_token& stop);
  void load(const Request& request, const std::stop_token& stop);
  bool replaced(const Request& request);

  const std::shared_ptr<MemoryBudget> memory_;
  std::mutex mutex_;
  std::condition_variable_any came_;
  std::list<Request> requests_;  ///< one for each data set, to be done
  std::list<Request> shown_;     ///< the last one for each data set
  std::jthread thread_;          // declared last: it uses the other members
};

}  // namespace scolopax::server
