// SPDX-License-Identifier: Apache-2.0
// The two loops that serve all sessions: one renders a sample pass at a time, in turn; the other encodes and
// hands out. Each is a step that says when it wants to run again, for a LoopThread or a test.
#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "server/progressive_render.h"
#include "server/session_store.h"

namespace scolopax::server {

class RenderLoop {
 public:
  using OnPass = std::function<void(const PassResult&)>;
  RenderLoop(SessionStore& store, RenderContext context, OnPass onPass)
      : store_(store), context_(std::move(context)), onPass_(std::move(onPass)) {}
  /// One pass of the next session that has work. The first pictures after edits come first; between two of
  /// them, sessions at rest have a short turn: none starves another.
  std::optional<TimePoint> step();
  /// Ends the running pass early unless it makes the first picture after an edit. From any thread.
  void interrupt() { interrupted_ = true; }

 private:
  using Renders = std::vector<std::unique_ptr<ProgressiveRender>>;
  void followStore();
  Renders::iterator nextTurn();

  SessionStore& store_;
  const RenderContext context_;
  const OnPass onPass_;
  Renders renders_;  ///< whose turn is next stands first
  std::atomic<bool> interrupted_{false};
  bool othersUrgent_ = false;  ///< at the turn that was chosen
  bool lastUrgent_ = false;    ///< the last turn was for the first picture after an edit
};

class EncodeLoop {
 public:
  /// `wake` makes the loop run again.
  EncodeLoop(SessionStore& store, Now now, Log log, Background& background, std::function<void()> wake,
             std::shared_ptr<MemoryBudget> memory = nullptr)
      : store_(store),
        now_(std::move(now)),
        log_(std::move(log)),
        background_(background),
        wake_(std::move(wake)),
        memory_(std::move(memory)) {}
  /// Encodes every picture that waits, one a session, and hands out the frames that are due. Large pictures
  /// are encoded in the background, one a session at a time.
  std::optional<TimePoint> step();

 private:
  SessionStore& store_;
  const Now now_;
  const Log log_;
  Background& background_;
  const std::function<void()> wake_;
  const std::shared_ptr<MemoryBudget> memory_;
  std::map<const Session*, std::shared_ptr<Background::Job>> jobs_;
};

/// JPEG of a rendered picture, 4:4:4: quality 90; while edits arrive 80, and 95 where it is smaller than the
/// scene's. Its memory is of the budget until nobody holds it any more.
EncodedFrame encodeFrame(const RenderedFrame& rendered, const Now& now,
                         const std::shared_ptr<MemoryBudget>& memory = nullptr);

}  // namespace scolopax::server
