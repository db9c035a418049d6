// SPDX-License-Identifier: Apache-2.0
#include "server/stop_rule.h"

namespace scolopax::server {

void measureFor(const StopRule& stop, const Renderer& renderer, const std::stop_token& cancel) {
  if (stop.error > 0 && renderer.errorTakesLong()) renderer.estimatedError(cancel);
}

bool stopMet(const StopRule& stop, const Renderer& renderer, double seconds) {
  const std::uint32_t samples = renderer.samples();
  // The estimate is used from 16 samples on, since fewer samples may be equal by chance.
  const auto errorMet = [&] {
    return stop.error > 0 && samples >= 16 && !renderer.errorTakesLong() &&
           renderer.estimatedError() <= stop.error;
  };
  return samples > 0 && (samples >= kMaxSamples || (stop.samples > 0 && samples >= stop.samples) ||
                         (stop.seconds > 0 && seconds >= stop.seconds) || errorMet());
}

}  // namespace scolopax::server
