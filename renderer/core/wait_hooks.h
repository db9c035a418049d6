// SPDX-License-Identifier: Apache-2.0
// Lets a pool of threads run other work while one of its threads only waits. What waits for other threads
// (SharedBuilds, loads of volumes) calls the hooks; the pool sets them.
#pragma once

namespace scolopax {

/// Called on a thread before and after it waits for what another thread computes.
class WaitHooks {
 public:
  virtual ~WaitHooks() = default;
  virtual void beforeWait() = 0;
  virtual void afterWait() noexcept = 0;
};

/// Those of the calling thread; null if it has none.
inline thread_local WaitHooks* waitHooks = nullptr;

/// Exists while the calling thread waits. No lock may be held that others need.
class Waiting {
 public:
  Waiting() {
    if (waitHooks) waitHooks->beforeWait();
  }
  ~Waiting() {
    if (waitHooks) waitHooks->afterWait();
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
};

}  // namespace scolopax
