// SPDX-License-Identifier: Apache-2.0
// One session: scene, revision, viewers and latest frame. Edits come in from network threads, the render
// thread takes the newest scene and hands in pictures, the encoder thread hands the frames out.
//
// Threads and locks:
//  1. Network threads edit, read, poll, join and leave; ONE render thread and ONE encoder thread serve all
//  sessions.
//  2. All that they share is in Session, behind its one mutex; each public function locks it once.
//  3. The mutex is never held while rendering or encoding: both work on snapshots (shared_ptr to const).
//  4. The renderer and its film belong to the render thread (ProgressiveRender) or, while there is one, to
//  the
//     background job that it began; no lock guards them. Beside a job that builds no scene, picks go on.
//  5. Only the encoder thread offers frames to viewers, and a frame of an older scene is not published,
//  whoever
//     encoded it, so that none can replace a newer one.
//  6. Viewers are called with the mutex held, so that they see edits in order: a ViewerSink only queues, it
//     neither blocks nor calls back.
//  7. An edit interrupts the running pass after it has changed the scene; RenderLoop takes the interruption
//     back before it looks at any scene, so no edit is lost between the two.
//  8. Nobody measures data with the mutex held: an edit that needs that throws Unmeasured and changes
//  nothing.
//  9. Waking a loop takes the loop's own, innermost mutex. The store's mutex is never held with a session's.
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
#include "server/pick.h"
#include "server/scene_resolver.h"

namespace scolopax::server {

/// A client that sees the session's pictures. Calls queue and return; they come with the session's mutex
/// held.
class ViewerSink {
 public:
  virtual ~ViewerSink() = default;
  /// `patch`: id of this viewer's last patch that the frame contains, 0 for none.
  virtual void offerFrame(const EncodedFrame& frame, std::uint32_t patch) = 0;
  /// Another client edited the scene: `patch` turns the resolved scene before into that of `revision`.
  virtual void sceneChanged(std::uint32_t revision, const nlohmann::json& patch) = 0;
  /// The scene cannot be rendered, or not now.
  virtual void renderFailed(const Error& error) = 0;
  /// The session has ended.
  virtual void sessionClosed(const std::string& reason) = 0;
};

using ViewerId = std::uint64_t;  ///< 0: nobody

/// Who edits, and on which condition.
struct EditOrigin {
  ViewerId viewer = 0;
  std::uint32_t patchId = 0;                ///< the viewer's own number for the edit
  std::optional<std::uint32_t> ifRevision;  ///< throws 409 when the scene is at another revision
};

/// What a script waits for.
struct FrameQuery {
  std::uint32_t after = 0;       ///< a frame with a larger number
  std::uint32_t minSamples = 1;  ///< with so many samples at least, or the final one
  bool aovs =
      false;  ///< that holds AOVs; the first such query makes a revision, from which they are recorded
  std::stop_token gone = {};  ///< nobody waits any more
};

/// What the render thread should do for a session; a snapshot.
struct RenderRequest {
  std::shared_ptr<const ResolvedScene> scene;
  std::uint32_t revision = 0;
  bool wanted = false;                     ///< somebody looks on or waits, and the scene can be rendered
  bool interactive = false;                ///< edits arrive
  TimePoint interactiveEnd;                ///< when that ends, if no edit comes
  std::vector<std::uint32_t> pollSamples;  ///< sample counts that scripts wait for
  bool aovs = false;                       ///< somebody has asked for AOVs
  std::optional<TimePoint> retryAt;        ///< when to try again what others' memory has refused
  std::uint32_t failures = 0;              ///< so far; after another one, the last picture may be lost
  std::optional<PendingPick> pick;         ///< the first that waits for its answer
};

/// Functions that act on the loops; called with or without the session's mutex held.
struct SessionHooks {
  Now now;
  std::function<void()> wakeRender;
  std::function<void()> wakeEncoder;
  std::function<void()> interruptRender;  ///< ends the running pass early, unless it is itself for an edit
};

class Session {
 public:
  /// The time after an edit during which speed counts more than quality.
  static constexpr std::chrono::milliseconds kInteractiveTime{200};

  /// After which what failed because others held the memory is tried again.
  static constexpr std::chrono::milliseconds kRetryTime{1000};

  /// Scripts that may wait at once.
  static constexpr std::size_t kMaxPolls = 8;
  /// Picks that may wait at once.
  static constexpr std::size_t kMaxPicks = 8;

  Session(std::string id, std::string token, std::shared_ptr<const SceneResolver> resolver,
          std::shared_ptr<const ResolvedScene> scene, SessionHooks hooks);

  const std::string& id() const { return id_; }
  const std::string& token() const { return token_; }  ///< secret: whoever has it may resume

  // --- network threads
  // ---------------------------------------------------------------------------------------
  struct SceneState {
    std::shared_ptr<const ResolvedScene> scene;
    std::uint32_t revision;
  };
  SceneState scene() const;
  /// Applies a patch (a whole scene) at once and returns the new revision. Throws and leaves the scene as it
  /// was: ProtocolError when the result is not a scene, Unmeasured until what it needs of the data is
  /// measured.
  SceneState patch(const nlohmann::json& patch, const EditOrigin& origin);
  SceneState replace(const nlohmann::json& scene, const EditOrigin& origin);

  /// The viewer gets the latest frame soon, then every new one.
  ViewerId addViewer(std::shared_ptr<ViewerSink> sink);
  void removeViewer(ViewerId id);
  /// `maxFps` 0: as fast as they come.
  void setView(ViewerId id, bool visible, double maxFps);
  std::size_t viewerCount() const;

  /// Waits for a full-resolution frame of the scene as it is now or newer; nullptr when none came in time or
  /// the session was closed. Throws ProtocolError(429) when too many wait already, and the Error with which
  /// the scene could not be rendered.
  std::shared_ptr<const EncodedFrame> waitForFrame(const FrameQuery& query,
                                                   std::chrono::milliseconds timeout);
  std::shared_ptr<const EncodedFrame> latestFrame() const;
  /// Asks what is visible in the scene as it is now or newer. `answered` is called once, on whatever thread,
  /// with the session's mutex held: it only queues; never, when the session is closed before. Throws
  /// ProtocolError: areaOf()'s, and 429 when too many wait already; and the Error with which the scene could
  /// not be rendered.
  PickId pick(const PickQuery& query, OnPicked answered);
  /// The same, and waits; nothing when no answer came in time or the session was closed. Throws what failed.
  std::optional<nlohmann::json> waitForPick(const PickQuery& query, std::chrono::milliseconds timeout,
                                            const std::stop_token& gone = {});
  /// Ends waiting and viewing; nothing is rendered any more.
  void close(const std::string& reason);
  /// When somebody last looked, edited or asked; now while there is a viewer or a waiting script.
  TimePoint lastUsed() const;

  // --- render thread
  // -----------------------------------------------------------------------------------------
  RenderRequest request() const;
  /// Takes the one waiting place of the encoder, replacing what is there.
  void submit(RenderedFrame frame);
  /// Nothing is rendered until the next edit; what failed because others held the memory, for kRetryTime or
  /// until somebody comes and asks for it. Viewers hear of it once.
  void fail(std::uint32_t revision, const Error& error);
  /// Nobody may wait any more for the answer.
  void answerPick(PickId id, const PickAnswer& answer);

  // --- encoder thread
  // ----------------------------------------------------------------------------------------
  /// The picture that waits, unless it has more pixels.
  std::optional<RenderedFrame> takeRendered(std::uint64_t mostPixels);
  /// From any thread. A frame that shows an older scene than the latest has come too late.
  void publish(EncodedFrame frame);
  /// Offers the latest frame to every viewer that has not had it and may have it now; returns when the next
  /// viewer's turn comes.
  std::optional<TimePoint> deliver();

 private:
  struct Viewer {
    std::shared_ptr<ViewerSink> sink;
    bool visible = true;
    TimePoint::duration period{0};  ///< between two offers, at least
    TimePoint lastOffer;
    std::uint32_t lastNumber = 0;
    std::uint32_t containedPatch = 0;
    struct PendingPatch {
      std::uint32_t id, revision;
    };
    std::deque<PendingPatch> pending;  ///< patches newer than the last frame offered
  };

  SceneState edit(std::shared_ptr<const ResolvedScene> next, const EditOrigin& origin);
  void checkRevision(const EditOrigin& origin) const;
  void retryIfBusy();
  PickId addPick(const PickQuery& query, OnPicked answered);

  struct WaitingPick : PendingPick {
    OnPicked answered;
  };

  const std::string id_, token_;
  const std::shared_ptr<const SceneResolver> resolver_;
  const SessionHooks hooks_;

  mutable std::mutex mutex_;
  std::condition_variable_any frameCame_;  ///< a frame, a failure, an edit or the end
  std::shared_ptr<const ResolvedScene> scene_;
  std::uint32_t revision_ = 1;
  std::optional<TimePoint> lastEdit_;  ///< that changed the picture
  TimePoint lastUsed_;
  bool closed_ = false;
  std::uint32_t failedRevision_ = 0;
  std::optional<Error> failure_;
  std::optional<TimePoint> retryAt_;  ///< of a failure because others held the memory
  std::uint32_t failures_ = 0;
  std::map<ViewerId, Viewer> viewers_;
  ViewerId nextViewer_ = 1;
  std::multiset<std::uint32_t> pollSamples_;  ///< one per waiting script
  std::vector<WaitingPick> picks_;            ///< the oldest first
  PickId lastPick_ = 0;
  bool aovs_ = false;
  std::optional<RenderedFrame> rendered_;  ///< waits for the encoder
  std::shared_ptr<const EncodedFrame> frame_;
  std::uint32_t frameNumber_ = 0;
};

}  // namespace scolopax::server
