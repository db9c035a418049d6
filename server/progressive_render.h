// SPDX-License-Identifier: Apache-2.0
// One session's renderer and film, and what is done with them next. Used by the render thread alone; takes
// scenes from Session and hands pictures back to it.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "renderer/core/memory_budget.h"
#include "renderer/renderer.h"
#include "server/background.h"
#include "server/film_state.h"
#include "server/resolution.h"
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

struct SceneTaking;
struct PictureMaking;

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
  using Next = void (ProgressiveRender::*)(PassResult&);

  bool finished(const RenderRequest& request) const;
  bool showDue(const RenderRequest& request) const;
  bool pickable(const RenderRequest& request) const;
  double wantedDivisor(const RenderRequest& request, int editedOthers);
  std::uint64_t filmSize() const;
  bool largeFilm() const;
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

  std::shared_ptr<Background::Job> job_;    ///< while there is one, the renderer is its alone
  Next next_ = nullptr;                     ///< what follows it
  std::shared_ptr<SceneTaking> taking_;     ///< the scene that is being built; else null
  std::shared_ptr<PictureMaking> showing_;  ///< the picture that is being made; else null

  PickTurn pick_;
  bool pickedLast_ = false;  ///< the last turn was for a pick: the picture has the next

  std::shared_ptr<const Volume> volume_;
  std::shared_ptr<Renderer> renderer_;
  FilmState film_;
  ResolutionPolicy resolution_;
  double filmSeconds_ = 0;  ///< spent on the film's samples
  std::uint32_t rebuildUs_ = 0, renderUs_ = 0;
  std::shared_ptr<const Image> reduced_;  ///< the last reduced picture of this revision, while it is of use
  double sampleError_ = 0;                ///< estimated RMSE of one sample while edits arrived; 0: not known
};

}  // namespace scolopax::server
