// SPDX-License-Identifier: Apache-2.0
// Data is loaded, and statistics of it are measured, when a scene first needs them. This takes long, so it is
// done only by threads that may wait, and without holding a lock.
#pragma once
#include <functional>
#include <stop_token>
#include <utility>

#include "renderer/core/error.h"

namespace scolopax::server {

/// Thrown when a result depends on data that has not been loaded or measured yet. Nothing has been changed
/// then.
class Unmeasured : public Error {
 public:
  using Measure = std::function<void(const std::stop_token&)>;
  explicit Unmeasured(Measure measure)
      : Error(ErrorCode::busy, "the data that the scene needs has not been loaded and measured yet"),
        measure_(std::move(measure)) {}
  /// Loads and measures it, or waits until another thread has done so. Throws Error:
  /// cancelled once `stop` is requested, busy and tooLarge if there is not enough memory.
  void measure(const std::stop_token& stop) const { measure_(stop); }

 private:
  Measure measure_;
};

/// Returns work(), after measuring the statistics that it needs. Throws what work() and Unmeasured::measure
/// throw.
template <class Work>
auto whenMeasured(const std::stop_token& stop, Work&& work) {
  for (;;) {
    try {
      return work();
    } catch (const Unmeasured& missing) {
      missing.measure(stop);
    }
  }
}

}  // namespace scolopax::server
