// SPDX-License-Identifier: Apache-2.0
// When a picture is good enough: made from a scene's `stop`, for sessions and for pictures that are rendered
// once.
#pragma once
#include <cstdint>

#include "renderer/renderer.h"

namespace scolopax::server {

/// Rendering ends when the first of these is met; 0 means no such limit.
struct StopRule {
  std::uint32_t samples = 0;
  double seconds = 0;
  double error = 0;
};

/// Makes the renderer measure what stopMet() needs but does not wait for. Throws Error(cancelled) soon after
/// `cancel` is requested.
void measureFor(const StopRule& stop, const Renderer& renderer, const std::stop_token& cancel = {});
/// Whether rendering ends, given the renderer's samples and error and the seconds spent. An error that would
/// take long to estimate counts as not reached.
bool stopMet(const StopRule& stop, const Renderer& renderer, double seconds);

}  // namespace scolopax::server
