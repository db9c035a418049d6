// SPDX-License-Identifier: Apache-2.0
// One future per key: a value that several callers request at the same time is built once, on a thread of its
// own.
#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/core/wait_hooks.h"

namespace scolopax {

/// Every function may be called from any thread. A value is cached while any caller holds it.
template <class Key, class Value, class Less = std::less<Key>>
class SharedBuilds {
 public:
  using Result = std::shared_ptr<const Value>;
  using Make = std::function<Result(std::stop_token)>;

  /// Returns the value, and waits for it if necessary. Unless it exists or is being built, `make` builds it
  /// on a thread of its own. Throws what `make` throws, and Error(cancelled) once `stop` is requested. `make`
  /// is asked to stop when no caller waits for its value any more.
  Result get(const Key& key, const Make& make, const std::stop_token& stop) {
    if (stop.stop_requested()) throwCancelled();
    std::shared_ptr<Build> build;
    {
      const std::lock_guard lock(mutex_);
      std::erase_if(entries_, [](const auto& item) {
        return item.second.value.expired() && item.second.build.expired();
      });
      Entry& entry = entries_[key];
      if (Result value = entry.value.lock()) return value;
      build = entry.build.lock();
      if (!build) {
        build = std::make_shared<Build>(make);
        entry.build = build;
      }
    }
    Result value = build->wait(stop);
    const std::lock_guard lock(mutex_);
    entries_[key].value = value;
    return value;
  }

 private:
  [[noreturn]] static void throwCancelled() {
    throw Error(ErrorCode::cancelled, "build cancelled: its result is no longer needed");
  }

  /// Owned only by its waiters: when the last one leaves, the build is stopped.
  class Build {
   public:
    explicit Build(const Make& make)
        : thread_([this, make](const std::stop_token& stop) mutable { run(make, stop); }) {}

    Result wait(const std::stop_token& stop) {
      const Waiting waiting;  // declared first: ends when the mutex is free again
      std::unique_lock lock(mutex_);
      if (!ended_.wait(lock, stop, [this] { return done_; })) throwCancelled();
      if (failure_) std::rethrow_exception(failure_);
      return value_;
    }

   private:
    void run(const Make& make, const std::stop_token& stop) {
      Result value;
      std::exception_ptr failure;
      try {
        value = make(stop);
      } catch (...) {
        failure = std::current_exception();
      }
      const std::lock_guard lock(mutex_);
      value_ = std::move(value);
      failure_ = failure;
      done_ = true;
      ended_.notify_all();
    }

    std::mutex mutex_;
    std::condition_variable_any ended_;
    bool done_ = false;
    Result value_;
    std::exception_ptr failure_;
    std::jthread thread_;  // declared last: stopped and joined before the other members are destroyed
  };
  struct Entry {
    std::weak_ptr<Build> build;
    std::weak_ptr<const Value> value;
  };

  std::mutex mutex_;
  std::map<Key, Entry, Less> entries_;
};

}  // namespace scolopax
