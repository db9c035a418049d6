// SPDX-License-Identifier: Apache-2.0
// One session's renderer and film, and the policy of what to render and show next. Used by the render
// thread alone; takes scenes from Session and hands pictures back to it.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "renderer/core/memory_budget.h"
#include "renderer/renderer.h"
#include "server/background.h"
#include "server/session.h"

namespace scolopax::server {

using MakeRenderer = std::function<std::unique_ptr<Renderer>(std::shared_ptr<const Volume>)>;
/// Takes one line that a client must not see.
using Log = std::function<void(const std::string&)>;

/// Filled by each turn, for the metrics.
struct PassResult {
  bool rendered = false;  ///< a sample was added to every pixel
  bool cancelled = false;
  bool built = false;      ///< a scene was taken over that had been built in the background
  bool abandoned = false;  ///< such a build was given up
  std::uint64_t pixels = 0;
  double renderSeconds = 0, rebuildSeconds = 0;
};

/// When passes are cut, and what is done elsewhere.
struct RenderPolicy {
  std::chrono::microseconds frameTarget{25'000};      ///< for one pass while edits arrive
  std::chrono::microseconds leastTarget{4'000};       ///< that many edited sessions leave each other
  std::chrono::milliseconds interactiveInterval{33};  ///< between frames while edits arrive
  std::chrono::milliseconds stillInterval{500};       ///< between frames once samples are many
  std::chrono::milliseconds tooLate{75};              ///< the first picture of an edit is begun anew, coarser
  int restFactor = 12;                   ///< a pass may last so much longer at each step from small to whole
  std::chrono::milliseconds slice{100};  ///< of a slow pass, before other sessions have their turn
  std::chrono::milliseconds politeSlice{8};  ///< when one of them waits for an edit's first picture
  std::chrono::milliseconds shield{300};     ///< for so long a pass goes on when its scene is stale
};

/// What all sessions are rendered with. `wake` makes the render loop look at its sessions again.
struct RenderContext {
  MakeRenderer makeRenderer;
  RenderPolicy policy;
  Now now;
  Log log;
  Background& background;
  std::function<void()> wake;
  std::shared_ptr<MemoryBudget> memory = nullptr;  ///< for pictures; null: as much as there is
};

class ProgressiveRender {
 public:
  /// What its pass must leave to the other sessions.
  struct Others {
    int edited = 0;       ///< those that edits arrive at
    bool urgent = false;  ///< one of them has urgent work
  };
  /// What there is to do, the least important first.
  enum class Work {
    none,
    refine,  ///< a better picture while edits arrive, which the next will replace
    still,   ///< the picture at rest
    urgent   ///< the first picture after an edit
  };
  /// `interrupted` ends passes early that are not urgent; they go on in their next turn.
  ProgressiveRender(std::shared_ptr<Session> session, const RenderContext& context,
                    const std::atomic<bool>& interrupted);
  ~ProgressiveRender();
  ProgressiveRender(const ProgressiveRender&) = delete;
  ProgressiveRender& operator=(const ProgressiveRender&) = delete;

  const std::shared_ptr<Session>& session() const { return session_; }
  /// What run() would do now; nothing while work goes on in the background.
  Work work() const;
  /// Whether edits arrive.
  bool edited() const;
  /// When there may be work without being woken.
  std::optional<TimePoint> dueAt() const;
  /// Gives up what is built or measured in the background, once nobody wants it any more.
  void supervise();
  /// A part of a pick, or one sample pass at most, with the rebuild before it and the submission after it, of
  /// which what takes long goes on in the background until a later turn. Never throws: what cannot be
  /// rendered is told to the session.
  PassResult run(const Others& others);

 private:
  struct Taking;
  struct Showing;
  using Next = void (ProgressiveRender::*)(PassResult&);

  bool sceneStale(const RenderRequest& request) const;
  bool keepsPass(const RenderRequest& request) const;
  bool finished(const RenderRequest& request) const;
  bool showDue(const RenderRequest& request) const;
  bool firstOfEdit(const RenderRequest& request) const;
  bool lateForEdit(const RenderRequest& request) const;
  bool pickable(const RenderRequest& request) const;
  double wantedDivisor(const RenderRequest& request, int editedOthers) const;
  std::uint64_t filmSize() const;
  bool largeFilm() const;
  void learnFromUnfinished();
  void fail(const RenderRequest& request, const Error& error);
  void dropRenderer();

  bool pickIn(const RenderRequest& request);
  void turn(const RenderRequest& request, const Others& others, PassResult& result);
  /// Does the work, here or in the background, and then what is next, here.
  void perform(bool inBackground, Background::Work work, Next next, PassResult& result);
  void collect(PassResult& result);
  void takeScene(const RenderRequest& request, const Others& others, PassResult& result);
  void sceneTaken(PassResult& result);
  void addSample(bool urgent, bool othersUrgent, PassResult& result);
  void sampleAdded(PassResult& result);
  void show(const RenderRequest& request, PassResult& result);
  void pictureMade(PassResult& result);

  const std::shared_ptr<Session> session_;
  const RenderContext& context_;
  const std::atomic<bool>& interrupted_;

  std::shared_ptr<Background::Job> job_;  ///< while there is one, the renderer is its alone
  Next next_ = nullptr;                   ///< what follows it
  std::shared_ptr<Taking> taking_;        ///< the scene that is being built; else null
  std::shared_ptr<Showing> showing_;      ///< the picture that is being made; else null

  PickTurn pick_;
  bool pickedLast_ = false;  ///< the last turn was for a pick: the picture has the next

  std::shared_ptr<const Volume> volume_;
  std::shared_ptr<Renderer> renderer_;
  std::shared_ptr<const ResolvedScene> scene_;  ///< that the film shows; null before the first
  std::uint32_t revision_ = 0;
  bool recording_ = false;   ///< the renderer keeps AOVs
  bool unfinished_ = false;  ///< a pass has begun and was interrupted, or has used up its slice
  bool abandoned_ = false;   ///< the pass before it was given up for a newer scene
  bool small_ = false;       ///< the film was begun while edits arrived
  bool restShown_ = false;   ///< the film has been shown since they stopped
  TimePoint passBegan_;
  double passSeconds_ = 0;         ///< spent on the pass so far
  double divisor_ = 1;             ///< of width and height
  double interactiveDivisor_ = 0;  ///< the last one while edits arrived; 0 before
  double filmSeconds_ = 0;         ///< spent on the film's samples
  /// Of one sample, from earlier passes: at rest, and while edits arrive.
  std::optional<double> secondsPerPixel_[2];
  std::uint32_t rebuildUs_ = 0, renderUs_ = 0;

  FrameInfo shown_;                       ///< the last frame handed in; revision 0 before the first
  std::uint32_t shownFailures_ = 0;       ///< of the session, when it was made
  std::shared_ptr<const Image> reduced_;  ///< the last reduced picture of this revision, while it is of use
  double sampleError_ = 0;                ///< estimated RMSE of one sample while edits arrived; 0: not known
  TimePoint shownAt_;
};

/// The smallest of 1, 1.5, 2, 3, 4, 6, 8, ... by which width and height must be divided so that a pass fits
/// the target. `current`, that of the pass before (0: none), is kept until another fits clearly better: a
/// picture that changes its resolution to and fro is worse than one that is a little late.
double divisorForTarget(std::uint64_t pixels, double secondsPerPixel, double targetSeconds,
                        double current = 0);

/// The scene for a smaller picture of the same view: its height divided and rounded up, its width the least
/// that shows as much as the whole picture. One sample at the centre of a pixel says more of a small picture,
/// which is smoothly enlarged, than one anywhere in the pixel.
Scene atDivisor(Scene scene, double divisor);

}  // namespace scolopax::server
