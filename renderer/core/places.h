// SPDX-License-Identifier: Apache-2.0
// A limit on how many threads do something at once.
#pragma once
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <stop_token>

namespace scolopax {

/// A fixed number of places, first come, first served. Every function may be called from any thread.
class Places {
 public:
  /// `count` must be at least 1.
  explicit Places(int count) : free_(count) {}
  /// Number of threads that wait for a place.
  std::size_t waiting() const;

  /// One of the places, for the lifetime of this object.
  class Place {
   public:
    /// Waits for a place. Throws Error(cancelled) once `stop` is requested.
    Place(Places& places, const std::stop_token& stop);
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    Places& places_;
  };

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  int free_;
  std::deque<const Place*> waiting_;  ///< the first has waited longest
};

}  // namespace scolopax
