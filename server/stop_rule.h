// SPDX-License-Identifier: Apache-2.0
// When a picture is good enough: from a scene's `stop`, for sessions and for pictures that are rendered once.
#pragma once
#include <cstdint>

#include "renderer/renderer.h"

namespace scolopax::server {

/// When rendering ends: at the first that is met; 0 means no such bound.
struct StopRule {
  std::uint32_t samples = 0;
  double seconds = 0;
  double error = 0;
};

/// Has the renderer measure what stopMet() needs of it and does not wait for. Throws Error(cancelled) soon
/// after `cancel` is requested.
void measureFor(const StopRule& stop, const Renderer& renderer, const std::stop_token& cancel = {});
/// Whether rendering ends at what `renderer` has and the seconds it took. An error that would take long to
/// find counts as not reached.
bool stopMet(const StopRule& stop, const Renderer& renderer, double seconds);

}  // namespace scolopax::server
