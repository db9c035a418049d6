// SPDX-License-Identifier: Apache-2.0
// A mutex that threads get in the order in which they ask. A thread that locks a std::mutex again and again
// may keep all others from it.
#pragma once
#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace scolopax::cuda {

class FairMutex {
 public:
  void lock() {
    std::unique_lock lock(mutex_);
    const std::uint64_t turn = next_++;
    changed_.wait(lock, [&] { return turn == current_; });
  }
  void unlock() {
    const std::lock_guard lock(mutex_);
    ++current_;
    changed_.notify_all();
  }
  /// Number of threads that hold it or wait for it.
  std::uint64_t asking() const {
    const std::lock_guard lock(mutex_);
    return next_ - current_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t next_ = 0, current_ = 0;
};

}  // namespace scolopax::cuda
