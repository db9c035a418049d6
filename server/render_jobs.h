// SPDX-License-Identifier: Apache-2.0
// What ProgressiveRender hands over, here or to the background: a scene on its way into the renderer, and a
// picture on its way out of the film.
#pragma once
#include <cstdint>
#include <memory>
#include <stop_token>

#include "renderer/core/memory_budget.h"
#include "renderer/renderer.h"
#include "server/frame.h"
#include "server/session.h"

namespace scolopax::server {

/// What is drawn while edits arrive, or soon after. The method is ours to choose only where the scene leaves
/// it to the server: then the quickest that looks like the picture at rest.
Scene drawnScene(const ResolvedScene& resolved, double divisor, bool interactive);

/// A scene on its way into the renderer.
struct SceneTaking {
  RenderRequest request;
  TimePoint begin;
  double divisor = 1;
  Scene scene;
  bool record = false;  ///< from this scene on, AOVs are recorded
  bool inBackground = false;
  std::shared_ptr<Renderer> renderer;
  RebuildStats stats;

  /// Whether the expensive part of this build is useless for `other`.
  bool uselessFor(const RenderRequest& other) const {
    return other.scene->dataset->volume != request.scene->dataset->volume ||
           other.scene->render.macrocell != scene.macrocell;
  }
};

/// A picture on its way out of the film.
struct PictureMaking {
  RenderedFrame frame;
  bool interactive = false;              ///< made while edits arrive
  bool aovs = false;                     ///< made with them
  std::shared_ptr<const Image> reduced;  ///< to be mixed in; null: nothing is
  double sampleError = 0;
  double share = 0;  ///< of the new picture in the mixture

  /// Throws Error(cancelled) when it is stopped while the error is measured.
  void make(const Renderer& renderer, std::uint64_t pixels, const std::shared_ptr<MemoryBudget>& memory,
            const std::stop_token& stop);
};

}  // namespace scolopax::server
