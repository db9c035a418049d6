// SPDX-License-Identifier: Apache-2.0
// The two loops that serve all sessions: one renders a sample pass at a time, in turn; the other encodes and
// hands out. Each is a step that says when it wants to run again, for a LoopThread or a test.
#pragma once
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
  /// One pass of the next session that has work; none starves another.
  std::optional<TimePoint> step();

 private:
  void followStore();

  SessionStore& store_;
  const MakeRenderer makeRenderer_;
  const ProgressiveRender::Options options_;
  const Now now_;
  const Log log_;
  const OnPass onPass_;
  std::vector<std::unique_ptr<ProgressiveRender>> renders_;  ///< whose turn is next stands first
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

/// JPEG of a rendered picture: quality 75, 4:2:0 while edits arrive; 90, 4:4:4 when still.
EncodedFrame encodeFrame(const RenderedFrame& rendered, const Now& now);

}  // namespace scolopax::server
