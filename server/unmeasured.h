// SPDX-License-Identifier: Apache-2.0
// What a scene needs of its data is measured when it is first needed, which takes long: by threads that may
// wait, and with no lock held.
#pragma once
#include <functional>
#include <stop_token>
#include <utility>

#include "renderer/core/error.h"

namespace scolopax::server {

/// Thrown, with nothing changed, when the result depends on data that has not been measured yet.
class Unmeasured : public Error {
 public:
  using Measure = std::function<void(const std::stop_token&)>;
  explicit Unmeasured(Measure measure)
      : Error(ErrorCode::busy, "what the scene needs of its data is yet to be measured"),
        measure_(std::move(measure)) {}
  /// Waits until it is measured, for all who ask from then on. Throws Error: cancelled once `stop` is
  /// requested, busy and tooLarge where there is no memory for it.
  void measure(const std::stop_token& stop) const { measure_(stop); }

 private:
  Measure measure_;
};

/// What work() returns, once all is measured that it needs. Throws what it and Unmeasured::measure throw.
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
