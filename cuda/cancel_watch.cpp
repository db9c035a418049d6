// SPDX-License-Identifier: Apache-2.0
#include "cuda/cancel_watch.h"

namespace scolopax::cuda {

void CancelWatch::add(const Flag& from, Flag& to) {
  const std::lock_guard lock(mutex_);
  watched_.push_back({&from, &to});
  if (watched_.size() == 1) added_.notify_one();
}

void CancelWatch::remove(const Flag& to) {
  const std::lock_guard lock(mutex_);
  std::erase_if(watched_, [&](const Watched& watched) { return watched.to == &to; });
}

void CancelWatch::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  // Sleeps while no pass is under way.
  while (added_.wait(lock, stop, [&] { return !watched_.empty(); }) && !stop.stop_requested()) {
    for (const Watched& watched : watched_)
      if (*watched.from) *watched.to = true;
    added_.wait_for(lock, stop, kEvery, [] { return false; });
  }
}

}  // namespace scolopax::cuda
