// SPDX-License-Identifier: Apache-2.0
// Passes the flags that cancel passes on to kernels, which cannot read them. The threads that launch passes
// cannot do that: they wait for the kernels.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

namespace scolopax::cuda {

/// Every function may be called from any thread.
class CancelWatch {
 public:
  using Flag = std::atomic<bool>;

  CancelWatch() : thread_([this](const std::stop_token& stop) { run(stop); }) {}
  CancelWatch(const CancelWatch&) = delete;
  CancelWatch& operator=(const CancelWatch&) = delete;

  /// Until remove(to), sets `to` soon after `from` is set: after kEvery, on an idle machine.
  void add(const Flag& from, Flag& to);
  /// From now on, neither of the two flags is used.
  void remove(const Flag& to);

  static constexpr std::chrono::milliseconds kEvery{1};

 private:
  void run(const std::stop_token& stop);

  struct Watched {
    const Flag* from;
    Flag* to;
  };
  std::mutex mutex_;
  std::condition_variable_any added_;
  std::vector<Watched> watched_;
  std::jthread thread_;  // last, because it uses the others
};

}  // namespace scolopax::cuda
