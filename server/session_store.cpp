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
  if (list_->closed) throw protocol::ProtocolError(503, "", *list_->closed);
  if (list_->sessions.size() >= options_.maxSessions)
    throw protocol::ProtocolError(
        503, "",
        "the limit of " + std::to_string(options_.maxSessions) + " sessions is reached; retry later");
}

std::shared_ptr<Session> SessionStore::create(const nlohmann::json& scene) {
  expire();
  {
    const std::lock_guard lock(list_->mutex);
    checkRoom();  // before resolving the scene, which takes time
  }
  auto session = std::make_shared<Session>(createToken(), createToken(), resolver_,
                                           resolver_->replaceNow(scene), hooks_);
  const std::lock_guard lock(list_->mutex);
  checkRoom();  // again, because other threads may have created sessions
  list_->sessions.push_back(session);
  hooks_.wakeRender();  // the loop will end the session if nobody uses it
  return session;
}

std::shared_ptr<Session> SessionStore::find(std::string_view id) const {
  const std::lock_guard lock(list_->mutex);
  const auto found = std::find_if(list_->sessions.begin(), list_->sessions.end(),
                                  [&](const auto& s) { return s->id() == id; });
  return found == list_->sessions.end() ? nullptr : *found;
}

std::shared_ptr<Session> SessionStore::findByToken(std::string_view token) const {
  const std::lock_guard lock(list_->mutex);
  for (const auto& session : list_->sessions)
    if (sameToken(session->token(), token)) return session;
  return nullptr;
}

bool SessionStore::remove(std::string_view id) {
  std::shared_ptr<Session> session;
  {
    const std::lock_guard lock(list_->mutex);
    const auto found = std::find_if(list_->sessions.begin(), list_->sessions.end(),
                                    [&](const auto& s) { return s->id() == id; });
    if (found == list_->sessions.end()) return false;
    session = *found;
    list_->sessions.erase(found);
  }
  session->close("the session was deleted");
  hooks_.wakeRender();  // the loop releases the session's renderer
  return true;
}

std::vector<std::shared_ptr<Session>> SessionStore::List::all() const {
  const std::lock_guard lock(mutex);
  return sessions;
}

std::vector<std::shared_ptr<Session>> SessionStore::all() const { return list_->all(); }

std::function<bool()> SessionStore::pictureRelease() const {
  return [weak = std::weak_ptr(list_)] {
    const auto list = weak.lock();
    if (!list) return false;
    std::multimap<TimePoint, std::shared_ptr<Session>> byUse;
    for (auto& session : list->all()) byUse.emplace(session->lastUsed(), std::move(session));
    return std::any_of(byUse.begin(), byUse.end(), [](const auto& one) { return one.second->dropPicture(); });
  };
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
    const std::lock_guard lock(list_->mutex);
    list_->closed = reason;
    sessions = std::exchange(list_->sessions, {});
  }
  for (const auto& session : sessions) session->close(reason);
}

}  // namespace scolopax::server
