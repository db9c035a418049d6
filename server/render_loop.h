// SPDX-License-Identifier: Apache-2.0
// The two loops that serve all sessions: one renders a sample pass at a time, in turn; the other encodes and
// hands out. Each is a step that says when it wants to run again, for a LoopThread or a test.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "server/progressive_render.h"
#include "server/session_store.h"

namespace scolopax::server {

class RenderLoop {
 public:
  using OnPass = std::function<void(const PassResult&)>;
  RenderLoop(SessionStore& store, MakeRenderer makeRenderer, ProgressiveRender::Options options, Now now,
             Log log, OnPass onPass);
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
  const MakeRenderer makeRenderer_;
  const ProgressiveRender::Options options_;
  const Now now_;
  const Log log_;
  const OnPass onPass_;
  Renders renders_;  ///< whose turn is next stands first
  std::atomic<bool> interrupted_{false};
  bool othersUrgent_ = false;  ///< at the turn that was chosen
  bool lastUrgent_ = false;    ///< the last turn was for the first picture after an edit
};

class EncodeLoop {
 public:
  EncodeLoop(SessionStore& store, Now now, Log log)
      : store_(store), now_(std::move(now)), log_(std::move(log)) {}
  /// Encodes every picture that waits, one a session, and hands out the frames that are due.
  std::optional<TimePoint> step();

 private:
  SessionStore& store_;
  const Now now_;
  const Log log_;
};

/// JPEG of a rendered picture, 4:4:4: quality 90; while edits arrive 80, and 95 where it is smaller than the
/// scene's.
EncodedFrame encodeFrame(const RenderedFrame& rendered, const Now& now);

}  // namespace scolopax::server
