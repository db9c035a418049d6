// SPDX-License-Identifier: Apache-2.0
// The two loops that serve all sessions. One renders the sessions in turn, one sample pass at a time; the
// other encodes frames and delivers them. Each is a step that returns when to run again, called by a
// LoopThread or by a test. The same holds for the function that watches the first loop.
#pragma once
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
  /// If the context's memory budget is used up, the pictures of sessions that nobody watches are dropped, and
  /// then their renderers.
  RenderLoop(SessionStore& store, RenderContext context, OnPass onPass);
  /// Runs one turn of the next session that has work. First pictures after edits have priority. Between two
  /// of them, a session at rest gets a short turn, so that no session starves.
  std::optional<TimePoint> step();
  /// Interrupts the running pass, unless it makes the first picture after an edit or is a short turn between
  /// two of those. Interrupts a running pick. From any thread.
  void interrupt() { interrupter_.interrupt(); }
  /// Interrupts the running pass or pick and all later ones. From any thread.
  void stop() { interrupter_.stop(); }
  /// Interrupts the running pass or pick if one of its rays takes too long; it then continues in the
  /// background. A step of a loop of its own, which RenderContext::wakeWatch wakes.
  std::optional<TimePoint> watch() { return interrupter_.watch(); }

 private:
  using Renders = std::vector<std::unique_ptr<ProgressiveRender>>;
  void followStore();
  Renders::iterator nextTurn();

  SessionStore& store_;
  const RenderContext context_;
  const OnPass onPass_;
  Renders renders_;  ///< in the order of their turns
  PassInterrupter interrupter_;
  bool othersUrgent_ = false;  ///< the chosen turn is not urgent, but another session has an urgent one
  bool lastUrgent_ = false;    ///< the last turn was urgent
};

class EncodeLoop {
 public:
  /// `wake` makes the loop run again.
  EncodeLoop(SessionStore& store, Now now, Log log, Background& pictures, std::function<void()> wake,
             std::shared_ptr<MemoryBudget> memory = nullptr)
      : store_(store),
        now_(std::move(now)),
        log_(std::move(log)),
        pictures_(pictures),
        wake_(std::move(wake)),
        memory_(std::move(memory)) {}
  /// Encodes the waiting pictures, at most one per session, and delivers the frames that are due. Large
  /// pictures are encoded in the background, one per session at a time.
  std::optional<TimePoint> step();

 private:
  SessionStore& store_;
  const Now now_;
  const Log log_;
  Background& pictures_;
  const std::function<void()> wake_;
  const std::shared_ptr<MemoryBudget> memory_;
  std::map<const Session*, std::shared_ptr<Background::Job>> jobs_;
};

/// Encodes a rendered picture as JPEG with 4:4:4 sampling. The quality is 95 for a reduced picture, otherwise
/// 80 while edits arrive and 90 at rest. The memory of the result is charged to the budget until the result
/// is released.
EncodedFrame encodeFrame(const RenderedFrame& rendered, const Now& now,
                         const std::shared_ptr<MemoryBudget>& memory = nullptr);

}  // namespace scolopax::server
