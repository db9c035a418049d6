// SPDX-License-Identifier: Apache-2.0
// Chooses how a scene with Method::automatic is rendered, by thumbnails of it.
#pragma once
#include <cstdint>
#include <stop_token>
#include <vector>

#include "renderer/data/render_plan.h"
#include "renderer/engine/levels.h"
#include "renderer/launcher.h"

namespace scolopax {

/// Method::superposed, or quadrature at a base step with levels of corrections.
struct AutomaticChoice {
  Method method = Method::raymarch;
  Resolution resolution{1, false};
  std::vector<Level> levels;
  std::uint64_t rays = 0;  ///< rays of the thumbnails
};

/// Fetches and visits of macrocells that the thumbnails of quadrature may take, and those of the tracker.
/// More would be tens of thousands for each of their rays.
inline constexpr std::uint64_t kMostChoiceWork = std::uint64_t(1) << 30;

/// Chooses the resolutions that need the least work for a given noise, where those of the film's samples have
/// no bias that would be seen while a scene is edited. Takes the tracker where corrections converge so slowly
/// that it needs less work, and where thumbnails of quadrature would take more than kMostChoiceWork. Costs
/// are counted in fetches, so the choice is the same for the same scene and volume. Throws Error(cancelled)
/// soon after `stop` is requested.
AutomaticChoice chooseAutomatically(Launcher& launcher, const RenderPlan& plan,
                                    const std::stop_token& stop = {});

}  // namespace scolopax
