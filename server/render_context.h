// SPDX-License-Identifier: Apache-2.0
// What the renders of all sessions share: clock, time limits, background threads, memory. Made by the
// application for RenderLoop, and used by ProgressiveRender and CurrentPick.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "renderer/core/memory_budget.h"
#include "renderer/renderer.h"
#include "server/background.h"
#include "server/config.h"
#include "server/frame.h"
#include "server/parked_renderers.h"
#include "server/prefetch.h"
#include "server/resolution.h"
#include "server/volume_cache.h"

namespace scolopax::server {

using MakeRenderer = std::function<std::unique_ptr<Renderer>(std::shared_ptr<const Volume>)>;
/// Receives a line that clients must not see.
using Log = std::function<void(const std::string&)>;

/// `wake` makes the render loop check its sessions again.
struct RenderContext {
  MakeRenderer makeRenderer;
  RenderPolicy policy;
  Now now;
  Log log;
  Background& pictures;  ///< for large pictures (adding samples, making, encoding) and for releasing films
  Background& passes;    ///< for passes and picks with slow rays
  Background& errors;    ///< for pictures whose error takes long to measure
  Background& builds;    ///< for scenes, including the automatic choice of the method
  std::function<void()> wake;
  std::shared_ptr<MemoryBudget> memory = nullptr;     ///< for pictures; null: no limit
  std::function<void()> wakeWatch = [] {};            ///< makes RenderLoop::watch() run again
  double maxPickSeconds = Config().maxRenderSeconds;  ///< from the beginning of a pick to its answer
  std::shared_ptr<VolumeCache> volumes = nullptr;  ///< from which data sets come; null: they stay in memory
  std::shared_ptr<Prefetch> prefetch = nullptr;    ///< null: nothing is loaded in advance
  std::shared_ptr<ParkedRenderers> parked = std::make_shared<ParkedRenderers>();
};

}  // namespace scolopax::server
