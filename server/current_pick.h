// SPDX-License-Identifier: Apache-2.0
// The pick on which a session works: in short turns on the render thread or, where its rays are slow, in the
// background. Belongs to ProgressiveRender, and passes the answer to Session.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>

#include "server/background.h"
#include "server/pass_interrupter.h"
#include "server/pick.h"
#include "server/render_context.h"

namespace scolopax::server {

class RenderPart;
class Session;

/// A pick that has begun keeps to its scene and needs the renderer no longer, so neither edits nor other
/// sessions make it start over.
class CurrentPick {
 public:
  CurrentPick(Session& session, const RenderContext& context, PassInterrupter& interrupter)
      : session_(session), context_(context), interrupter_(interrupter) {}
  ~CurrentPick() { end(); }
  CurrentPick(const CurrentPick&) = delete;
  CurrentPick& operator=(const CurrentPick&) = delete;

  /// Whether this pick has begun.
  bool has(PickId id) const { return work_ && work_->pick.id == id; }
  /// Whether the background works on the pick, so that run() has to wait.
  bool busy() const { return work_ && work_->job && !work_->job->done(); }
  /// The time at which supervise() will end the pick.
  std::optional<TimePoint> dueAt() const;
  /// Ends the pick if nobody waits for it any more, or if it has taken too long.
  void supervise();
  /// Begins a pick or goes on with it, for a short turn, and answers it when it is complete. A pick begins
  /// with the scene and the volume that `renderer` has. Throws nothing: if the pick fails, that is the
  /// answer, and the log receives a cause that clients must not see. Requires !busy().
  void run(const PendingPick& pick, const std::shared_ptr<const ResolvedScene>& scene, std::uint32_t revision,
           const std::shared_ptr<const Volume>& volume, const std::shared_ptr<const Renderer>& renderer);

 private:
  struct Work {
    PendingPick pick;
    std::shared_ptr<const ResolvedScene> scene;
    std::shared_ptr<const Volume> volume;
    std::uint32_t revision;
    std::shared_ptr<Picking> picking;
    TimePoint latest;                           ///< when it has taken too long
    int idleTurns = 0;                          ///< turns in succession in which hardly any sample was taken
    std::shared_ptr<RenderPart> part = {};      ///< in the background
    std::shared_ptr<Background::Job> job = {};  ///< renders that part
  };
  bool goOn();
  bool runHere();
  void startInBackground();
  void answer(PickId id, PickAnswer answer);
  void end();

  Session& session_;
  const RenderContext& context_;
  PassInterrupter& interrupter_;
  std::optional<Work> work_;
  TimePoint slowUntil_{};  ///< until this time, picks run in the background
};

}  // namespace scolopax::server
