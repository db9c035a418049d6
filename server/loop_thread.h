// SPDX-License-Identifier: Apache-2.0
// A thread that repeats a step while there is work, and otherwise sleeps until a given time or until it is
// woken.
#pragma once
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "server/frame.h"

namespace scolopax::server {

class LoopThread {
 public:
  /// Returns when to run again: at once if the time is in the past, only when woken if it is nullopt.
  using Step = std::function<std::optional<TimePoint>()>;

  ~LoopThread() { stop(); }
  void start(Step step);
  /// From any thread. A call during a step makes the loop run another one.
  void wake();
  /// Ends the loop after the current step and waits for its thread. May be called twice.
  void stop();

 private:
  void run(const Step& step);

  std::mutex mutex_;
  std::condition_variable wakeUp_;
  bool woken_ = false, stopping_ = false;
  std::thread thread_;
};

}  // namespace scolopax::server
