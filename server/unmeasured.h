// SPDX-License-Identifier: Apache-2.0
// Statistics of the data are measured when a scene first needs them. This takes long, so only threads that
// may wait do it, and with no lock held.
#pragma once
#include <functional>
#include <stop_token>
#include <utility>

#include "renderer/core/error.h"

namespace scolopax::server {

/// Thrown, with nothing changed, when a result depends on statistics that have not been measured yet.
class Unmeasured : public Error {
 public:
  using Measure = std::function<void(const std::stop_token&)>;
  explicit Unmeasured(Measure measure)
      : Error(ErrorCode::busy, "the statistics of the data that the scene needs are not measured yet"),
        measure_(std::move(measure)) {}
  /// Measures them, or waits until they are measured; later callers find them kept. Throws Error: cancelled
  /// once `stop` is requested, busy and tooLarge if there is not enough memory.
  void measure(const std::stop_token& stop) const { measure_(stop); }

 private:
  Measure measure_;
};

/// Returns work(), after measuring all that it needs. Throws what work() and Unmeasured::measure throw.
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
