// SPDX-License-Identifier: Apache-2.0
// A session's renderer and film, and the decisions what to do with them next. Used only by the render thread.
// Takes scenes from Session and submits pictures to it.
#pragma once
#include <memory>
#include <optional>
#include <variant>

#include "renderer/renderer.h"
#include "server/background.h"
#include "server/current_pick.h"
#include "server/film_state.h"
#include "server/pass_interrupter.h"
#include "server/render_context.h"
#include "server/resolution.h"
#include "server/session.h"

namespace scolopax::server {

/// The outcome of one turn, for the metrics.
struct PassResult {
  bool rendered = false;  ///< a sample was added to every pixel
  bool cancelled = false;
  bool built = false;      ///< a build in the background was completed
  bool abandoned = false;  ///< a build in the background was cancelled
  std::uint64_t pixels = 0;
  double renderSeconds = 0, rebuildSeconds = 0;
};

struct SceneBuild;
class RenderPart;
struct SampleAddition;
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
  /// go on.
  Urgency urgency() const;
  /// Whether edits arrive.
  bool edited() const;
  /// The time at which there may be work again even if nothing wakes the loop.
  std::optional<TimePoint> dueAt() const;
  /// Cancels the background jobs whose results are no longer wanted, ends a pick that has taken too long, and
  /// parks the renderer while nobody watches.
  void supervise();
  /// Runs one turn: a slice of a pick, or at most one sample pass with the rebuild before it and the
  /// submission after it. Long steps run in the background and are completed in a later turn. Does not throw:
  /// failures are reported to the session.
  PassResult run(const OtherSessions& others);

 private:
  /// Work on the renderer.
  using Task = std::variant<std::monostate, std::shared_ptr<SceneBuild>, std::shared_ptr<RenderPart>,
                            std::shared_ptr<SampleAddition>, std::shared_ptr<PictureJob>>;
  /// The work of a turn, unless a background job is running or the turn is a pick's.
  enum class Step { none, buildScene, addSample, show };

  RenderRequest request() const;
  Step step(const RenderRequest& request) const;
  bool finished(const RenderRequest& request) const;
  bool showDue(const RenderRequest& request) const;
  bool building() const { return std::holds_alternative<std::shared_ptr<SceneBuild>>(task_); }
  bool taskUseless(const RenderRequest& request) const;
  bool pickReady(const RenderRequest& request) const;
  std::optional<TimePoint> pictureDueAt() const;
  bool filmGoesOn(const RenderRequest& request) const;
  double wantedDivisor(const RenderRequest& request, int editedOthers);
  std::uint64_t filmSize() const;
  void fail(const RenderRequest& request, const Error& error);
  void endTask();
  void dropRenderer();
  void park();
  void unpark();

  bool pickIn(const RenderRequest& request);
  void turn(const RenderRequest& request, const OtherSessions& others, PassResult& result);
  /// Runs a task, on this thread if `background` is null, and then ended() on this thread.
  template <class T>
  void perform(Background* background, std::shared_ptr<T> task, PassResult& result);
  void collect(PassResult& result);
  void taskDone(PassResult& result);
  void ended(std::monostate, PassResult&) {}
  void ended(const std::shared_ptr<SceneBuild>& build, PassResult& result);
  void ended(const std::shared_ptr<RenderPart>& part, PassResult& result);
  void ended(const std::shared_ptr<SampleAddition>&, PassResult& result);
  void ended(const std::shared_ptr<PictureJob>& picture, PassResult& result);
  void buildScene(const RenderRequest& request, const OtherSessions& others, PassResult& result);
  std::chrono::microseconds urgentSlice(int editedOthers) const;
  void addSample(const RenderRequest& request, const OtherSessions& others, PassResult& result);
  void show(const RenderRequest& request, PassResult& result);

  const std::shared_ptr<Session> session_;
  const RenderContext& context_;
  PassInterrupter& interrupter_;

  Task task_;                             ///< what is being done with the renderer, here or in the background
  std::shared_ptr<Background::Job> job_;  ///< does the task; owns the renderer, though picks may begin

  CurrentPick pick_;
  bool pickedLast_ = false;  ///< the last turn was a pick's, so the next is the picture's

  std::shared_ptr<const Dataset> dataset_;  ///< of the last build
  std::size_t time_ = 0;
  std::shared_ptr<const Volume> volume_;  ///< the renderer's
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
