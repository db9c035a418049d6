// SPDX-License-Identifier: Apache-2.0
// The jobs of ProgressiveRender, which run on its own thread or in the background: building a scene,
// rendering a part of a pass, and making a picture of the film.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <stop_token>

#include "renderer/core/memory_budget.h"
#include "renderer/renderer.h"
#include "server/frame.h"
#include "server/session.h"

namespace scolopax::server {

/// The scene that is drawn, at 1 / `divisor` of the resolution. While edits arrive (`interactive`), a scene
/// with the method `auto` is drawn by the fastest method that looks like the picture at rest.
Scene drawnScene(const ResolvedScene& resolved, double divisor, bool interactive);

/// The build of a scene in the renderer.
struct SceneBuild {
  RenderRequest request;
  TimePoint begin;
  double divisor = 1;
  Scene scene;
  bool record = false;  ///< AOVs are recorded from this scene on
  bool inBackground = false;
  bool onlyChooses = false;  ///< only the automatic choice of the method takes long
  std::shared_ptr<Renderer> renderer;
  RebuildStats stats;

  /// Whether the expensive part of this build is of no use for `other`.
  bool uselessFor(const RenderRequest& other) const {
    return (onlyChooses && other.edit != request.edit) ||
           other.scene->dataset->volume != request.scene->dataset->volume ||
           other.scene->render.macrocell != scene.macrocell;
  }
};

/// The part of a pass that one turn renders.
struct PassPart {
  std::chrono::microseconds slice{};
  bool inBackground = false;
  std::atomic<bool> cancel{false};  ///< ends the part early, if it is in the background
  bool complete = false;            ///< the pass is complete
  bool interrupted = false;         ///< the pass was interrupted
  double seconds = 0;               ///< time it took

  /// Stops early once `interrupt` is true, even in the middle of a ray.
  void render(Renderer& renderer, const Now& now, const std::atomic<bool>& interrupt);
  /// The same in the background, once `stop` is requested.
  void render(Renderer& renderer, const Now& now, const std::stop_token& stop);
};

/// The making of a picture from the film.
struct PictureJob {
  RenderedFrame frame;
  bool interactive = false;              ///< made while edits arrive
  bool aovs = false;                     ///< includes AOVs
  std::shared_ptr<const Image> reduced;  ///< the picture to blend in; null: none
  double sampleError = 0;
  double share = 0;  ///< weight of the new picture in the blend

  /// Throws Error(cancelled) if `stop` is requested while the error is measured.
  void make(const Renderer& renderer, std::uint64_t pixels, const std::shared_ptr<MemoryBudget>& memory,
            const std::stop_token& stop);
};

}  // namespace scolopax::server
