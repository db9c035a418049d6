// SPDX-License-Identifier: Apache-2.0
// Lets others work in the place of a thread that only waits: SharedBuilds tells, and a pool of threads
// listens.
#pragma once

namespace scolopax {

/// Called on a thread before and after it waits for what another thread computes.
class WaitHooks {
 public:
  virtual ~WaitHooks() = default;
  virtual void beforeWait() = 0;
  virtual void afterWait() noexcept = 0;
};

/// The calling thread's; null: nobody needs to know.
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
