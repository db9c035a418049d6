// SPDX-License-Identifier: Apache-2.0
#include "server/loop_thread.h"

namespace scolopax::server {

void LoopThread::start(Step step) {
  thread_ = std::thread([this, step = std::move(step)] { run(step); });
}

void LoopThread::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  wakeUp_.notify_one();
}

void LoopThread::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wakeUp_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void LoopThread::run(const Step& step) {
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
      woken_ = false;
    }
    const std::optional<TimePoint> next = step();
    std::unique_lock lock(mutex_);
    const auto ready = [this] { return woken_ || stopping_; };
    if (next)
      wakeUp_.wait_until(lock, *next, ready);
    else
      wakeUp_.wait(lock, ready);
  }
}

}  // namespace scolopax::server
