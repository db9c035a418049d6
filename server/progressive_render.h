// SPDX-License-Identifier: Apache-2.0
// A session's renderer and film, and the decisions what to do with them next. Used only by the render thread.
// Takes scenes from Session and submits pictures to it.
#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "renderer/core/memory_budget.h"
#include "renderer/renderer.h"
#include "server/background.h"
#include "server/film_state.h"
#include "server/parked_renderers.h"
#include "server/pass_interrupter.h"
#include "server/resolution.h"
#include "server/session.h"

namespace scolopax::server {

using MakeRenderer = std::function<std::unique_ptr<Renderer>(std::shared_ptr<const Volume>)>;
/// Receives a line that clients must not see.
using Log = std::function<void(const std::string&)>;

/// The outcome of one turn, for the metrics.
struct PassResult {
  bool rendered = false;  ///< a sample was added to every pixel
  bool cancelled = false;
  bool built = false;      ///< a build in the background was completed
  bool abandoned = false;  ///< a build in the background was cancelled
  std::uint64_t pixels = 0;
  double renderSeconds = 0, rebuildSeconds = 0;
};

/// Shared by the renders of all sessions. `wake` makes the render loop check its sessions again.
struct RenderContext {
  MakeRenderer makeRenderer;
  RenderPolicy policy;
  Now now;
  Log log;
  Background& pictures;  ///< for large pictures (adding samples, making, encoding) and for releasing films
  Background& passes;    ///< for passes with slow rays
  Background& errors;    ///< for pictures whose error takes long to measure
  Background& builds;    ///< for scenes, including the automatic choice of the method
  std::function<void()> wake;
  std::shared_ptr<MemoryBudget> memory = nullptr;  ///< for pictures; null: no limit
  std::function<void()> wakeWatch = [] {};         ///< makes RenderLoop::watch() run again
  std::shared_ptr<ParkedRenderers> parked = std::make_shared<ParkedRenderers>();
};

struct SceneBuild;
struct PassPart;
struct PictureJob;

class ProgressiveRender {
 public:
  /// The needs of the other sessions, which limit this session's pass.
  struct OtherSessions {
    int edited = 0;       ///< number of other sessions at which edits arrive
    bool urgent = false;  ///< one of them has urgent work
  };
  /// Urgency of a session's next turn, in ascending order.
  enum class Urgency {
    none,
    refine,  ///< a better picture while edits arrive, which the next edit will replace
    atRest,  ///< the picture at rest
    urgent   ///< the first picture after an edit, or a pick
  };
  /// Passes that `interrupter` has interrupted continue in their next turn.
  ProgressiveRender(std::shared_ptr<Session> session, const RenderContext& context,
                    PassInterrupter& interrupter);
  ~ProgressiveRender();
  ProgressiveRender(const ProgressiveRender&) = delete;
  ProgressiveRender& operator=(const ProgressiveRender&) = delete;

  const std::shared_ptr<Session>& session() const { return session_; }
  /// Urgency of the work that run() would do now; none while a background job is running, unless a pick can
  /// be answered.
  Urgency urgency() const;
  /// Whether edits arrive.
  bool edited() const;
  /// The time at which there may be work again even if nothing wakes the loop.
  std::optional<TimePoint> dueAt() const;
  /// Cancels the background job if its result is no longer wanted, and parks the renderer while nobody
  /// watches.
  void supervise();
  /// Runs one turn: a slice of a pick, or at most one sample pass with the rebuild before it and the
  /// submission after it. Long steps run in the background and are completed in a later turn. Does not throw:
  /// failures are reported to the session.
  PassResult run(const OtherSessions& others);

 private:
  using Next = void (ProgressiveRender::*)(PassResult&);
  /// The work of a turn, unless a background job is running or the turn is a pick's.
  enum class Step { none, buildScene, addSample, show };

  RenderRequest request() const;
  Step step(const RenderRequest& request) const;
  bool finished(const RenderRequest& request) const;
  bool showDue(const RenderRequest& request) const;
  bool pickable(const RenderRequest& request) const;
  bool filmGoesOn(const RenderRequest& request) const;
  double wantedDivisor(const RenderRequest& request, int editedOthers);
  std::uint64_t filmSize() const;
  void fail(const RenderRequest& request, const Error& error);
  void dropRenderer();
  void park();
  void unpark();

  bool pickIn(const RenderRequest& request);
  void turn(const RenderRequest& request, const OtherSessions& others, PassResult& result);
  /// Runs `work`, on this thread if `background` is null, and then `next` on this thread.
  void perform(Background* background, Background::Work work, Next next, PassResult& result);
  void collect(PassResult& result);
  void buildScene(const RenderRequest& request, const OtherSessions& others, PassResult& result);
  void sceneBuilt(PassResult& result);
  std::chrono::microseconds urgentSlice(int editedOthers) const;
  void addSample(const RenderRequest& request, const OtherSessions& others, PassResult& result);
  void partRendered(PassResult& result);
  void sampleAdded(PassResult& result);
  void show(const RenderRequest& request, PassResult& result);
  void pictureMade(PassResult& result);

  const std::shared_ptr<Session> session_;
  const RenderContext& context_;
  PassInterrupter& interrupter_;

  std::shared_ptr<Background::Job> job_;  ///< while it exists, it owns the renderer, except for picks
  Next next_ = nullptr;                   ///< to be called when the job is done
  std::shared_ptr<SceneBuild> build_;     ///< the scene that is being built; else null
  std::shared_ptr<PassPart> part_;        ///< the part of a pass that is being rendered; else null
  std::shared_ptr<PictureJob> picture_;   ///< the picture that is being made; else null

  CurrentPick pick_;
  bool pickedLast_ = false;  ///< the last turn was a pick's, so the next is the picture's

  std::shared_ptr<const Volume> volume_;
  std::shared_ptr<Renderer> renderer_;
  bool parked_ = false;  ///< the renderer is in RenderContext::parked, unless it has been dropped
  FilmState film_;
  ResolutionPolicy resolution_;
  TimePoint slowUntil_{};   ///< until this time, passes are rendered in the background
  bool quick_ = false;      ///< the last part of a pass took no longer than its turn
  double filmSeconds_ = 0;  ///< spent on the film's samples
  std::uint32_t rebuildUs_ = 0, renderUs_ = 0;
  std::shared_ptr<const Image>
      reduced_;             ///< the last reduced picture of the film's scene, while it is needed
  double sampleError_ = 0;  ///< estimated RMSE of one sample while edits arrived; 0: not known
};

}  // namespace scolopax::server
