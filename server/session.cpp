// SPDX-License-Identifier: Apache-2.0
#include "server/session.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "protocol/json_text.h"
#include "protocol/messages.h"
#include "protocol/patch.h"
#include "protocol/problem.h"

namespace scolopax::server {
namespace {

// Limits the ids of patches that are kept for a viewer that gets no frames. Beyond it the oldest are
// forgotten; then the patch id in headers only lags behind.
constexpr std::size_t kMaxPendingPatches = 1024;

/// Whether two frames of a session show the same picture: one has been made again.
bool isSamePicture(const FrameInfo& a, const FrameInfo& b) {
  return a.revision == b.revision && a.samples == b.samples && a.interactive == b.interactive &&
         a.reduced == b.reduced && a.mixed == b.mixed && a.final == b.final;
}

/// Calls a function of a client. Its failure must neither affect other clients nor end a loop's thread.
template <class Call, class... Arguments>
void notify(const Call& call, Arguments&&... arguments) noexcept {
  try {
    std::invoke(call, std::forward<Arguments>(arguments)...);
  } catch (...) {
  }
}

template <class Failure>
PickAnswer failed(const Failure& failure) {
  return {{}, std::make_exception_ptr(failure)};
}

}  // namespace

Session::Session(std::string id, std::string token, std::shared_ptr<const SceneResolver> resolver,
                 std::shared_ptr<const ResolvedScene> scene, SessionHooks hooks)
    : id_(std::move(id)),
      token_(std::move(token)),
      resolver_(std::move(resolver)),
      hooks_(std::move(hooks)),
      scene_(std::move(scene)),
      lastUsed_(hooks_.now()) {}

Session::SceneState Session::scene() const {
  const std::lock_guard lock(mutex_);
  return {scene_, revision_};
}

Session::SceneState Session::patch(const nlohmann::json& patch, const EditOrigin& origin) {
  return edit(origin, [&](const ResolvedScene& before) { return resolver_->patchNow(before, patch); });
}

Session::SceneState Session::replace(const nlohmann::json& scene, const EditOrigin& origin) {
  return edit(origin, [&](const ResolvedScene& before) {
    return resolver_->replaceNow(scene, before.defaultSamples);
  });
}

void Session::checkRevision(const EditOrigin& origin) const {
  if (closed_) throw protocol::ProtocolError(404, "", "the session has ended");
  if (origin.ifRevision && *origin.ifRevision != revision_)
    throw protocol::ProtocolError(409, "",
                                  "expected the scene at revision " + std::to_string(*origin.ifRevision) +
                                      ", found revision " + std::to_string(revision_));
}

Session::SceneState Session::edit(const EditOrigin& origin, const Resolve& resolve) {
  const std::lock_guard editing(editing_);
  std::shared_ptr<const ResolvedScene> before;  // released without the mutex, as that may take time
  std::unique_lock lock(mutex_);
  checkRevision(origin);
  before = scene_;
  // Everything that takes time is done without the mutex.
  lock.unlock();
  auto next = resolve(*before);
  const bool filmChanges = !makeSameFilm(*next, *before);
  lock.lock();
  // The message for the other viewers; most sessions have only one. A query for AOVs may begin a revision
  // meanwhile.
  std::string change;
  std::shared_ptr<const std::string> message;
  for (std::uint32_t announced = 0;
       announced != revision_ + 1 && viewers_.size() > viewers_.count(origin.viewer);) {
    announced = revision_ + 1;
    lock.unlock();
    if (change.empty()) change = protocol::jsonText(protocol::patchBetween(before->resolved, next->resolved));
    message = std::make_shared<const std::string>(protocol::sceneText(announced, change));
    lock.lock();
  }
  checkRevision(origin);  // a query for AOVs may have begun a revision, or the session may have ended
  scene_ = std::move(next);
  ++revision_;
  lastUsed_ = hooks_.now();
  if (aovs_ && (lastUsed_ - lastAovs_ >= kKeepAovs || resolver_->tooLarge(scene_->render, true)))
    aovs_ = false;
  if (filmChanges) {
    lastEdit_ = lastUsed_;
    editRevision_ = revision_;
    hooks_.interruptRender();
  }
  for (auto& [id, viewer] : viewers_) {
    if (id != origin.viewer) {
      notify(&ViewerSink::sceneChanged, *viewer.sink, message);
      continue;
    }
    viewer.pending.push_back({origin.patchId, revision_});
    if (viewer.pending.size() > kMaxPendingPatches) viewer.pending.pop_front();
  }
  frameCame_.notify_all();
  hooks_.wakeRender();
  return {scene_, revision_};
}

ViewerId Session::addViewer(std::shared_ptr<ViewerSink> sink) {
  const std::lock_guard lock(mutex_);
  if (closed_) throw protocol::ProtocolError(404, "", "the session has ended");
  const ViewerId id = nextViewer_++;
  retryIfBusy();
  if (failedRevision_ == revision_) notify(&ViewerSink::renderFailed, *sink, *failure_);
  viewers_[id].sink = std::move(sink);
  lastUsed_ = hooks_.now();
  hooks_.wakeRender();
  hooks_.wakeEncoder();
  return id;
}

void Session::removeViewer(ViewerId id) {
  std::vector<OnPicked> left;
  {
    const std::lock_guard lock(mutex_);
    if (viewers_.erase(id) > 0) left = picks_.takeOf(id);
    if (!left.empty()) endWorkOnPicks();
    lastUsed_ = hooks_.now();
    hooks_.wakeRender();  // the loop also determines when the session ends
  }
  for (const OnPicked& answered : left)
    notify(answered, failed(protocol::ProtocolError(
                         409, "", "the stream left the session while this pick was waiting")));
}

void Session::setView(ViewerId id, bool visible, double maxFps) {
  const std::lock_guard lock(mutex_);
  const auto viewer = viewers_.find(id);
  if (viewer == viewers_.end()) return;
  viewer->second.visible = visible;
  if (visible) retryIfBusy();
  // At most an hour, because a longer period would overflow a duration.
  const auto seconds = maxFps > 0 ? std::min(1 / maxFps, 3600.0) : 0.0;
  viewer->second.period =
      std::chrono::duration_cast<TimePoint::duration>(std::chrono::duration<double>(seconds));
  hooks_.wakeRender();
  hooks_.wakeEncoder();
}

std::size_t Session::viewerCount() const {
  const std::lock_guard lock(mutex_);
  return viewers_.size();
}

std::shared_ptr<const EncodedFrame> Session::waitForFrame(const FrameQuery& query,
                                                          std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  if (pollSamples_.size() >= kMaxPolls)
    throw protocol::limitReached(429, kMaxPolls, "requests waiting for a session's frames");
  if (query.aovs) {
    if (const auto reason = resolver_->tooLarge(scene_->render, true))
      throw protocol::ProtocolError(422, "/aov", *reason);
    lastAovs_ = hooks_.now();
  }
  if (query.aovs && !aovs_) {
    // The picture starts over, so it needs a new revision.
    aovs_ = true;
    ++revision_;
    const auto message = std::make_shared<const std::string>(protocol::sceneText(revision_, "{}"));
    for (auto& [id, viewer] : viewers_) notify(&ViewerSink::sceneChanged, *viewer.sink, message);
  }
  retryIfBusy();
  const std::uint32_t revision = revision_;
  const auto fits = [&] {
    return frame_ && frame_->info.number > query.after && frame_->info.revision >= revision &&
           !frame_->info.interactive && !frame_->info.mixed && (frame_->aovs || !query.aovs) &&
           (frame_->image || !query.image) &&
           (frame_->info.samples >= query.minSamples || frame_->info.final);
  };
  const auto poll = pollSamples_.insert(query.minSamples);
  hooks_.wakeRender();
  frameCame_.wait_for(lock, query.gone, timeout,
                      [&] { return closed_ || fits() || failedRevision_ == revision_; });
  pollSamples_.erase(poll);
  lastUsed_ = hooks_.now();
  if (query.aovs) lastAovs_ = lastUsed_;
  hooks_.wakeRender();
  if (closed_) return nullptr;
  if (fits()) return frame_;
  if (failedRevision_ == revision_) throw Error(*failure_);
  return nullptr;
}

PickId Session::pick(const PickQuery& query, OnPicked answered, ViewerId viewer) {
  const std::lock_guard lock(mutex_);
  if (closed_) throw protocol::ProtocolError(404, "", "the session has ended");
  areaOf(query, scene_->render.width, scene_->render.height);
  retryIfBusy();
  if (failedRevision_ == revision_) throw Error(*failure_);
  const PickId id = picks_.add(query, revision_, viewer, std::move(answered));
  lastUsed_ = hooks_.now();
  hooks_.interruptRender();
  hooks_.wakeRender();
  return id;
}

std::optional<nlohmann::json> Session::waitForPick(const PickQuery& query, std::chrono::milliseconds timeout,
                                                   const std::stop_token& gone) {
  const auto came = std::make_shared<std::optional<PickAnswer>>();
  const PickId id = pick(query, [this, came](PickAnswer answer) {
    const std::lock_guard lock(mutex_);
    *came = std::move(answer);
    frameCame_.notify_all();
  });
  std::unique_lock lock(mutex_);
  frameCame_.wait_for(lock, gone, timeout, [&] { return closed_ || came->has_value(); });
  if (!*came) {
    picks_.take(id);
    endWorkOnPicks();
    return std::nullopt;
  }
  if ((*came)->failure) std::rethrow_exception((*came)->failure);
  return std::make_optional<nlohmann::json>(std::move((*came)->found));
}

/// Has the render loop see at once that a pick is no longer wanted.
void Session::endWorkOnPicks() {
  hooks_.interruptRender();
  hooks_.wakeRender();
}

std::shared_ptr<const EncodedFrame> Session::latestFrame() const {
  const std::lock_guard lock(mutex_);
  return frame_;
}

void Session::close(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(closed_, true)) return;
  hooks_.interruptRender();
  for (auto& [id, viewer] : viewers_) notify(&ViewerSink::sessionClosed, *viewer.sink, reason);
  viewers_.clear();
  picks_ = {};
  frameCame_.notify_all();
}

TimePoint Session::lastUsed() const {
  const std::lock_guard lock(mutex_);
  return viewers_.empty() && pollSamples_.empty() && picks_.empty() ? lastUsed_ : hooks_.now();
}

/// Whether a viewer wants pictures. Requires the mutex.
bool Session::seen() const {
  return std::any_of(viewers_.begin(), viewers_.end(), [](const auto& v) { return v.second.visible; });
}

bool Session::dropPicture() {
  std::shared_ptr<const EncodedFrame> last;  // released without the mutex, as that may take time
  const std::lock_guard lock(mutex_);
  if (seen() || !pollSamples_.empty() || !frame_ || (!frame_->image && !frame_->aovs)) return false;
  EncodedFrame rest = *frame_;
  rest.image.reset();
  rest.aovs.reset();
  last = std::exchange(frame_, std::make_shared<const EncodedFrame>(std::move(rest)));
  ++drops_;
  return true;
}

RenderRequest Session::request() const {
  const std::lock_guard lock(mutex_);
  RenderRequest request;
  request.scene = scene_;
  request.revision = revision_;
  request.pollSamples.assign(pollSamples_.begin(), pollSamples_.end());
  request.viewed = !viewers_.empty();
  request.aovs = aovs_;
  request.failures = failures_;
  request.drops = drops_;
  request.pick = picks_.oldest();
  request.pictures = !closed_ && (seen() || !pollSamples_.empty());
  request.wanted = request.pictures || request.pick;
  if (failedRevision_ == revision_) {
    if (request.wanted) request.retryAt = retryAt_;
    request.wanted = request.retryAt && hooks_.now() >= *request.retryAt;
  }
  if (seen() && lastEdit_) {
    request.interactiveEnd = *lastEdit_ + kInteractiveTime;
    request.interactive = hooks_.now() < request.interactiveEnd;
    request.edit = editRevision_;
  }
  return request;
}

void Session::submit(RenderedFrame frame) {
  std::optional<RenderedFrame> last;  // released without the mutex, as that may take time
  const std::lock_guard lock(mutex_);
  if (closed_) return;
  if (retryAt_ && frame.info.revision == failedRevision_) failedRevision_ = 0;  // the retry succeeded
  last = std::exchange(rendered_, std::move(frame));
  hooks_.wakeEncoder();
}

void Session::fail(std::uint32_t revision, const Error& error) {
  for (const OnPicked& answered : takeFailed(revision, error)) notify(answered, failed(error));
}

/// Stores the failure and returns the picks that fail with it.
std::vector<OnPicked> Session::takeFailed(std::uint32_t revision, const Error& error) {
  const std::lock_guard lock(mutex_);
  ++failures_;
  const bool busy = error.code() == ErrorCode::busy;
  const bool known = busy && retryAt_ && failedRevision_ == revision;  // a retry that failed again
  if (!known)
    for (auto& [id, viewer] : viewers_) notify(&ViewerSink::renderFailed, *viewer.sink, error);
  if (revision != revision_) return {};  // the current scene may be renderable
  failedRevision_ = revision;
  failure_ = error;
  retryAt_.reset();
  if (busy) retryAt_ = hooks_.now() + kRetryTime;
  frameCame_.notify_all();
  return picks_.takeAll();
}

void Session::answerPick(PickId id, PickAnswer answer) {
  OnPicked answered;
  {
    const std::lock_guard lock(mutex_);
    answered = picks_.take(id);
    if (!answered) return;
    lastUsed_ = hooks_.now();
  }
  notify(answered, std::move(answer));
}

void Session::retryIfBusy() {
  if (retryAt_) failedRevision_ = 0;
}

std::optional<RenderedFrame> Session::takeRendered(std::uint64_t mostPixels) {
  const std::lock_guard lock(mutex_);
  if (rendered_ && rendered_->image->pixels.size() > mostPixels) return std::nullopt;
  return std::exchange(rendered_, std::nullopt);
}

void Session::publish(EncodedFrame frame) {
  std::shared_ptr<const EncodedFrame> last;  // released without the mutex, as that may take time
  const std::lock_guard lock(mutex_);
  if (frame_ && frame.info.revision < frame_->info.revision) return;
  const bool again = frame_ && !frame_->image && isSamePicture(frame.info, frame_->info);
  frame.info.number = again ? frameNumber_ : ++frameNumber_;
  last = std::exchange(frame_, std::make_shared<const EncodedFrame>(std::move(frame)));
  frameCame_.notify_all();
}

std::optional<TimePoint> Session::deliver() {
  const std::lock_guard lock(mutex_);
  std::optional<TimePoint> next;
  if (!frame_) return next;
  const TimePoint now = hooks_.now();
  for (auto& [id, viewer] : viewers_) {
    if (!viewer.visible || viewer.lastNumber == frame_->info.number) continue;
    if (viewer.lastNumber > 0) {
      const auto turn = viewer.lastOffer + viewer.period;
      if (now < turn) {
        next = next ? std::min(*next, turn) : turn;
        continue;
      }
    }
    while (!viewer.pending.empty() && viewer.pending.front().revision <= frame_->info.revision) {
      viewer.containedPatch = viewer.pending.front().id;
      viewer.pending.pop_front();
    }
    viewer.lastOffer = now;
    viewer.lastNumber = frame_->info.number;
    notify(&ViewerSink::offerFrame, *viewer.sink, *frame_, viewer.containedPatch);
  }
  return next;
}

}  // namespace scolopax::server
