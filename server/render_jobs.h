// SPDX-License-Identifier: Apache-2.0
// The jobs of ProgressiveRender and CurrentPick, which run on the render thread or in the background:
// building a scene, rendering a part of a pass or a pick, adding a sample to the film, and making a picture
// of it.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <utility>

#include "renderer/core/memory_budget.h"
#include "renderer/renderer.h"
#include "server/frame.h"
#include "server/pass_interrupter.h"
#include "server/render_context.h"
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
  bool onlyChooses = false;              ///< only the automatic choice of the method takes long
  std::shared_ptr<Renderer> previous;    ///< of other data: released first, as its memory may be needed
  std::shared_ptr<const Volume> volume;  ///< null: loaded first
  std::shared_ptr<Renderer> renderer;    ///< null: made by `make`
  MakeRenderer make;
  RebuildStats stats;

  void run(const std::stop_token& stop);
  /// Whether the expensive part of this build is of no use for `other`.
  bool uselessFor(const RenderRequest& other) const {
    return (onlyChooses && other.edit != request.edit) || other.scene->dataset != request.scene->dataset ||
           other.scene->time != request.scene->time || other.scene->render.macrocell != scene.macrocell;
  }
};

/// The part of a pass or a pick that one turn renders.
class RenderPart {
 public:
  /// If a part exceeds its slice by this time, single rays take that long. On a busy machine, any part may
  /// exceed it a little.
  static constexpr std::chrono::milliseconds kSlowRay{300};
  /// Time for which parts are then rendered in the background, where they delay no other session.
  static constexpr std::chrono::seconds kSlowTime{10};

  /// Renderer::renderPixels() or Picking::run().
  using Render = std::function<bool(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget)>;
  RenderPart(Render render, std::chrono::microseconds slice, Now now)
      : render_(std::move(render)), slice_(slice), now_(std::move(now)) {}

  /// In the background: ends early, even in the middle of a ray, once `stop` is requested.
  void run(const std::stop_token& stop);
  /// On the render thread: ends early, even in the middle of a ray, if it is interrupted. An `urgent` part is
  /// not interrupted by edits.
  void run(PassInterrupter& interrupter, bool urgent);

  // --- once it has run ---
  bool complete() const { return complete_; }  ///< the pass or pick is complete
  bool interrupted() const { return interrupted_; }
  double seconds() const { return seconds_; }  ///< time it took
  bool hasSlowRays() const { return seconds_ >= std::chrono::duration<double>(slice_ + kSlowRay).count(); }

 private:
  void runUntil(const std::atomic<bool>& cancel);

  const Render render_;
  const std::chrono::microseconds slice_;
  const Now now_;
  std::atomic<bool> cancel_{false};
  bool complete_ = false, interrupted_ = false;
  double seconds_ = 0;
};

/// The adding of a complete pass to the film.
struct SampleAddition {
  std::shared_ptr<Renderer> renderer;
  bool estimate = false;  ///< the stop rule needs the error

  void run(const std::stop_token& stop);
};

/// The making of a picture from the film.
struct PictureJob {
  std::shared_ptr<const Renderer> renderer;
  std::uint64_t pixels = 0;
  std::shared_ptr<MemoryBudget> memory;
  RenderedFrame frame;
  bool interactive = false;              ///< made while edits arrive
  bool aovs = false;                     ///< includes AOVs
  std::shared_ptr<const Image> reduced;  ///< the picture to blend in; null: none
  double sampleError = 0;
  double share = 0;  ///< weight of the new picture in the blend

  /// Throws Error(cancelled) if `stop` is requested while the error is measured.
  void run(const std::stop_token& stop);
};

}  // namespace scolopax::server
