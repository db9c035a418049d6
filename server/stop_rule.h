// SPDX-License-Identifier: Apache-2.0
// When to stop rendering: made from a scene's `stop`, for sessions and for single renders.
#pragma once
#include <cstdint>

#include "renderer/renderer.h"

namespace scolopax::server {

/// Samples per pixel of a scene without a stop rule: of a single render, and in a session.
inline constexpr std::uint32_t kRenderSamples = 64, kSessionSamples = 4096;
/// The most samples per pixel that a scene may ask for, and that are ever made. Sample numbers beyond 2^31
/// would repeat random numbers.
inline constexpr std::uint32_t kMaxSamples = 1u << 24;

/// Rendering ends when the first of these limits is reached; 0 means no limit.
struct StopRule {
  std::uint32_t samples = 0;
  double seconds = 0;
  double error = 0;
};

/// Makes the renderer measure the error that stopMet() needs but does not wait for. Throws Error(cancelled)
/// soon after `cancel` is requested.
void measureFor(const StopRule& stop, const Renderer& renderer, const std::stop_token& cancel = {});
/// Whether rendering ends, after `seconds`. An error limit counts as not reached if the error would take long
/// to estimate.
bool stopMet(const StopRule& stop, const Renderer& renderer, double seconds);

}  // namespace scolopax::server
