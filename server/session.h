// SPDX-License-Identifier: Apache-2.0
// A session: its scene, revision, viewers and latest frame. Network threads edit the scene, the render thread
// takes the newest scene and submits pictures, and the encoder thread delivers frames.
//
// Threads and locks:
//  1. Network threads edit, read, poll, join and leave; one render thread and one encoder thread serve all
//     sessions.
//  2. Everything that they share is in Session, guarded by its mutex. It is never held for long, because the
//     loops need it for every session in every step.
//  3. The mutex is never held while rendering or encoding: both work on snapshots (shared_ptr to const).
//  4. The renderer and its film belong to the render thread (ProgressiveRender) or to the background job that
//     it has started; no lock guards them. A pick can begin during such a job unless it builds a scene. From
//     then on it is independent of the renderer, and a background job of its own may work on it.
//  5. Only the encoder thread offers frames to viewers. A frame of an older scene is not published, so it
//     cannot replace a newer one.
//  6. Viewers are called with the mutex held, so that they see edits in order. A ViewerSink therefore only
//     queues: it neither blocks nor calls back. The answer to a pick is passed on without the mutex, because
//     writing it may take long.
//  7. An edit interrupts the running pass after it has changed the scene. RenderLoop clears the interruption
//     before it reads any scene, so no edit is lost in between.
//  8. Edits of a session are made one at a time: an edit holds a mutex of its own, which no loop uses, while
//     it resolves the scene. It measures no data meanwhile: an edit that needs a measurement throws
//     Unmeasured and changes nothing.
//  9. Waking a loop locks that loop's mutex, which is the innermost one. The store's mutex is never held
//     together with a session's mutex.
#pragma once
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "renderer/core/error.h"
#include "server/frame.h"
#include "server/pick_queue.h"
#include "server/scene_resolver.h"

namespace scolopax::server {

/// A client that receives the session's pictures. Its functions are called with the session's mutex held, so
/// they must only queue. Their exceptions are ignored.
class ViewerSink {
 public:
  virtual ~ViewerSink() = default;
  /// `patch`: id of this viewer's last patch that the frame contains, 0 for none.
  virtual void offerFrame(const EncodedFrame& frame, std::uint32_t patch) = 0;
  /// Another client has edited the scene, or a query for AOVs has begun a revision. `message` is
  /// protocol::sceneText of the change, shared by all viewers.
  virtual void sceneChanged(const std::shared_ptr<const std::string>& message) = 0;
  /// The scene cannot be rendered, or not now.
  virtual void renderFailed(const Error& error) = 0;
  /// The session has ended.
  virtual void sessionClosed(const std::string& reason) = 0;
};

/// The origin of an edit, and a condition for it.
struct EditOrigin {
  ViewerId viewer = 0;
  std::uint32_t patchId = 0;  ///< the viewer's own number for the edit
  std::optional<std::uint32_t>
      ifRevision;  ///< if the scene is at another revision, the edit throws ProtocolError(409)
};

/// The frame that a script waits for.
struct FrameQuery {
  std::uint32_t after = 0;       ///< a frame with a larger number
  std::uint32_t minSamples = 1;  ///< with at least this many samples per pixel, or final
  bool aovs = false;             ///< with AOVs; the first such query begins a revision that records them
  std::stop_token gone = {};     ///< requested when nobody waits any more
  bool image = false;            ///< with the linear picture; otherwise the JPEG suffices
};

/// A snapshot of the work that the render thread should do for a session.
struct RenderRequest {
  std::shared_ptr<const ResolvedScene> scene;
  std::uint32_t revision = 0;
  bool wanted = false;       ///< somebody wants pictures or a pick, and the scene can be rendered
  bool pictures = false;     ///< a viewer or a script wants pictures
  bool interactive = false;  ///< edits arrive
  TimePoint interactiveEnd;  ///< when `interactive` ends if no further edit comes
  std::uint32_t edit = 0;    ///< revision of the last edit that changed the film; 0 if nobody watches
  std::vector<std::uint32_t> pollSamples;  ///< sample counts that scripts wait for
  bool viewed = false;                     ///< there is a viewer, even if it wants no pictures now
  bool aovs = false;                       ///< a script has asked for AOVs
  std::optional<TimePoint> retryAt;        ///< when to retry after a lack of memory
  std::uint32_t failures =
      0;  ///< number of failures so far; after a new one, the last picture may have been lost
  std::uint32_t drops = 0;          ///< number of calls of dropPicture() so far that dropped one
  std::optional<PendingPick> pick;  ///< the oldest one not yet answered
};

/// Functions that act on the loops. They are called with or without the session's mutex held.
struct SessionHooks {
  Now now;
  std::function<void()> wakeRender;
  std::function<void()> wakeEncoder;
  std::function<void()> interruptRender;  ///< interrupts the running pass, unless it is urgent, or pick
};

class Session {
 public:
  /// The time after an edit during which speed counts more than quality.
  static constexpr std::chrono::milliseconds kInteractiveTime{200};

  /// Time after which rendering is tried again if it failed because others held the memory.
  static constexpr std::chrono::milliseconds kRetryTime{1000};

  /// AOVs are recorded until the first edit that comes at least this long after the last query for them.
  static constexpr std::chrono::seconds kKeepAovs{60};

  /// Maximum number of scripts that wait at once.
  static constexpr std::size_t kMaxPolls = 8;

  Session(std::string id, std::string token, std::shared_ptr<const SceneResolver> resolver,
          std::shared_ptr<const ResolvedScene> scene, SessionHooks hooks);

  const std::string& id() const { return id_; }
  const std::string& token() const { return token_; }  ///< secret: allows a client to resume the session

  // --- network threads ---
  struct SceneState {
    std::shared_ptr<const ResolvedScene> scene;
    std::uint32_t revision;
  };
  SceneState scene() const;
  /// Applies a patch, or replaces the whole scene, and returns the new scene and revision. If the result is
  /// not a valid scene, throws ProtocolError; until the data that it needs has been measured, throws
  /// Unmeasured. In both cases the scene is unchanged.
  SceneState patch(const nlohmann::json& patch, const EditOrigin& origin);
  SceneState replace(const nlohmann::json& scene, const EditOrigin& origin);

  /// The viewer gets the latest frame soon, then every new one.
  ViewerId addViewer(std::shared_ptr<ViewerSink> sink);
  /// The viewer's picks that wait fail with ProtocolError(409).
  void removeViewer(ViewerId id);
  /// `maxFps` 0: no limit.
  void setView(ViewerId id, bool visible, double maxFps);
  std::size_t viewerCount() const;

  /// Waits for a full-resolution frame of the current scene or a newer one; nullptr if none came in time or
  /// the session was closed. Throws ProtocolError: 429 if too many scripts wait already, 422 if the AOVs can
  /// never fit into memory. Throws the renderer's Error if the scene cannot be rendered.
  std::shared_ptr<const EncodedFrame> waitForFrame(const FrameQuery& query,
                                                   std::chrono::milliseconds timeout);
  std::shared_ptr<const EncodedFrame> latestFrame() const;
  /// Asks what is visible in the current scene or a newer one. `answered` is called once, or never if the
  /// session is closed first. It is called on any thread, also on those of the loops, so it must not block,
  /// but without the session's mutex; its exceptions are ignored. Throws ProtocolError: 404 if the session
  /// has ended, 422 as areaOf(), 429 if too many picks wait already. Throws the renderer's Error if the scene
  /// cannot be rendered.
  PickId pick(const PickQuery& query, OnPicked answered, ViewerId viewer = 0);
  /// The same, but waits for the answer; nullopt if none came in time or the session was closed. Throws the
  /// error of a failed pick.
  std::optional<nlohmann::json> waitForPick(const PickQuery& query, std::chrono::milliseconds timeout,
                                            const std::stop_token& gone = {});
  /// Ends all waits and views. Nothing is rendered afterwards.
  void close(const std::string& reason);
  /// Time of the last view, edit or query; the current time while there is a viewer or a waiting script.
  TimePoint lastUsed() const;

  // --- any thread ---
  /// Releases the linear picture and the AOVs of the latest frame, for their memory, unless a viewer or a
  /// script wants pictures; the JPEG stays. When one does, they are made again, and the frame keeps its
  /// number. False if there are none to release.
  bool dropPicture();

  // --- render thread ---
  RenderRequest request() const;
  /// Makes this the frame that waits for the encoder, replacing an earlier one.
  void submit(RenderedFrame frame);
  /// To be called if the scene of `revision` failed to render. Nothing is rendered until the next edit or, if
  /// others held the memory (Error(busy)), until kRetryTime has passed or a client asks again. Viewers are
  /// notified once.
  void fail(std::uint32_t revision, const Error& error);
  /// Does nothing if no client waits for the answer any more.
  void answerPick(PickId id, PickAnswer answer);

  // --- encoder thread ---
  /// Takes the waiting picture, unless it has more than `mostPixels` pixels.
  std::optional<RenderedFrame> takeRendered(std::uint64_t mostPixels);
  /// Ignores a frame whose scene is older than that of the latest frame. From any thread.
  void publish(EncodedFrame frame);
  /// Offers the latest frame to every viewer that has not received it and is due. Returns when the next
  /// viewer will be due.
  std::optional<TimePoint> deliver();

 private:
  struct Viewer {
    std::shared_ptr<ViewerSink> sink;
    bool visible = true;
    TimePoint::duration period{0};  ///< minimum time between two offers
    TimePoint lastOffer;
    std::uint32_t lastNumber = 0;
    std::uint32_t containedPatch = 0;
    struct PendingPatch {
      std::uint32_t id, revision;
    };
    std::deque<PendingPatch> pending;  ///< patches newer than the last frame offered
  };

  bool seen() const;

  using Resolve = std::function<SceneResolver::Resolved(const ResolvedScene& before)>;
  SceneState edit(const EditOrigin& origin, const Resolve& resolve);
  void checkRevision(const EditOrigin& origin) const;
  void retryIfBusy();
  void endWorkOnPicks();
  std::vector<OnPicked> takeFailed(std::uint32_t revision, const Error& error);

  const std::string id_, token_;
  const std::shared_ptr<const SceneResolver> resolver_;
  const SessionHooks hooks_;

  std::mutex editing_;  ///< held while an edit is made; taken before mutex_
  mutable std::mutex mutex_;
  std::condition_variable_any
      frameCame_;  ///< notified of a frame, a pick's answer, a failure, an edit or the end
  std::shared_ptr<const ResolvedScene> scene_;
  std::uint32_t revision_ = 1;
  std::optional<TimePoint> lastEdit_;  ///< the last edit that changed the film
  std::uint32_t editRevision_ = 0;     ///< its revision
  TimePoint lastUsed_;
  bool closed_ = false;
  std::uint32_t failedRevision_ = 0;
  std::optional<Error> failure_;
  std::optional<TimePoint> retryAt_;  ///< set if rendering failed because others held the memory
  std::uint32_t failures_ = 0, drops_ = 0;
  std::map<ViewerId, Viewer> viewers_;
  ViewerId nextViewer_ = 1;
  std::multiset<std::uint32_t> pollSamples_;  ///< one per waiting script
  PickQueue picks_;
  bool aovs_ = false;                      ///< AOVs are recorded
  TimePoint lastAovs_;                     ///< the last query for them
  std::optional<RenderedFrame> rendered_;  ///< waits for the encoder
  std::shared_ptr<const EncodedFrame> frame_;
  std::uint32_t frameNumber_ = 0;
};

}  // namespace scolopax::server
