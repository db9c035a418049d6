// SPDX-License-Identifier: Apache-2.0
#include "server/session_store.h"

#include <algorithm>
#include <utility>

#include "protocol/problem.h"
#include "server/auth.h"

namespace scolopax::server {

SessionStore::SessionStore(std::shared_ptr<const SceneResolver> resolver, Options options, SessionHooks hooks)
    : resolver_(std::move(resolver)), options_(options), hooks_(std::move(hooks)) {}

/// Throws if another session cannot be created now. Requires the mutex.
void SessionStore::checkRoom() const {
  if (closed_) throw protocol::ProtocolError(503, "", *closed_);
  if (sessions_.size() >= options_.maxSessions)
    throw protocol::ProtocolError(
        503, "",
        "the limit of " + std::to_string(options_.maxSessions) + " sessions is reached; retry later");
}

std::shared_ptr<Session> SessionStore::create(const nlohmann::json& scene) {
  expire();
  {
    const std::lock_guard lock(mutex_);
    checkRoom();  // before resolving the scene, which takes time
  }
  auto session = std::make_shared<Session>(createToken(), createToken(), resolver_,
                                           resolver_->replaceNow(scene), hooks_);
  const std::lock_guard lock(mutex_);
  checkRoom();  // again, because other threads may have created sessions
  sessions_.push_back(session);
  hooks_.wakeRender();  // the loop will end the session if nobody uses it
  return session;
}

std::shared_ptr<Session> SessionStore::find(std::string_view id) const {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(sessions_.begin(), sessions_.end(), [&](const auto& s) { return s->id() == id; });
  return found == sessions_.end() ? nullptr : *found;
}

std::shared_ptr<Session> SessionStore::findByToken(std::string_view token) const {
  const std::lock_guard lock(mutex_);
  for (const auto& session : sessions_)
    if (sameToken(session->token(), token)) return session;
  return nullptr;
}

bool SessionStore::remove(std::string_view id) {
  std::shared_ptr<Session> session;
  {
    const std::lock_guard lock(mutex_);
    const auto found =
        std::find_if(sessions_.begin(), sessions_.end(), [&](const auto& s) { return s->id() == id; });
    if (found == sessions_.end()) return false;
    session = *found;
    sessions_.erase(found);
  }
  session->close("the session was deleted");
  hooks_.wakeRender();  // the loop releases the session's renderer
  return true;
}

std::vector<std::shared_ptr<Session>> SessionStore::all() const {
  const std::lock_guard lock(mutex_);
  return sessions_;
}

std::optional<TimePoint> SessionStore::expire() {
  std::optional<TimePoint> next;
  for (const auto& session : all()) {
    const TimePoint end = session->lastUsed() + options_.keep;
    if (end <= hooks_.now())
      remove(session->id());
    else
      next = next ? std::min(*next, end) : end;
  }
  return next;
}

void SessionStore::closeAll(const std::string& reason) {
  std::vector<std::shared_ptr<Session>> sessions;
  {
    const std::lock_guard lock(mutex_);
    closed_ = reason;
    sessions = std::exchange(sessions_, {});
  }
  for (const auto& session : sessions) session->close(reason);
}

}  // namespace scolopax::server
