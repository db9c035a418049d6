// SPDX-License-Identifier: Apache-2.0
#include "server/session_store.h"

#include <algorithm>
#include <utility>

#include "protocol/problem.h"
#include "server/auth.h"

namespace scolopax::server {

SessionStore::SessionStore(std::shared_ptr<const SceneResolver> resolver, Options options, SessionHooks hooks)
    : resolver_(std::move(resolver)),
      options_(options),
      hooks_(std::move(hooks)),
      places_(options_.maxSessions, hooks_.now) {}

std::shared_ptr<Session> SessionStore::create(const nlohmann::json& scene, const std::string& client) {
  expire();
  const auto full = [this] { return protocol::limitReached(503, options_.maxSessions, "sessions"); };
  list_->throwIfClosed();
  // The place first, because resolving the scene takes time.
  FairPlaces::Place place = places_.take(client);
  const auto other = place ? std::nullopt : places_.hasTooMany(client);
  if (!place && !other) throw full();
  auto session = std::make_shared<Session>(createToken(), createToken(), resolver_,
                                           resolver_->replaceNow(scene, kSessionSamples), hooks_);
  if (!place && endUnusedOf(*other)) place = places_.take(client);
  if (!place) throw full();
  list_->add({session, client, std::move(place)});
  hooks_.wakeRender();  // the loop will end the session if nobody uses it
  return session;
}

/// Ends the client's session that has been unused for the longest, if it has been unused for long enough.
bool SessionStore::endUnusedOf(const std::string& client) {
  std::shared_ptr<Session> oldest;
  for (const auto& session : list_->of(client))
    if (!oldest || session->lastUsed() < oldest->lastUsed()) oldest = session;
  return oldest && oldest->lastUsed() + kUnused <= hooks_.now() && remove(oldest->id());
}

std::shared_ptr<Session> SessionStore::find(std::string_view id) const {
  const std::lock_guard lock(list_->mutex);
  const auto found = list_->find(id);
  return found == list_->entries.end() ? nullptr : found->session;
}

std::shared_ptr<Session> SessionStore::findByToken(std::string_view token) const {
  const std::lock_guard lock(list_->mutex);
  for (const Entry& entry : list_->entries)
    if (sameToken(entry.session->token(), token)) return entry.session;
  return nullptr;
}

bool SessionStore::remove(std::string_view id) {
  std::shared_ptr<Session> session;
  {
    const std::lock_guard lock(list_->mutex);
    const auto found = list_->find(id);
    if (found == list_->entries.end()) return false;
    session = std::move(found->session);
    list_->entries.erase(found);
  }
  session->close("the session was deleted");
  hooks_.wakeRender();  // the loop releases the session's renderer
  return true;
}

void SessionStore::List::throwIfClosed() const {
  const std::lock_guard lock(mutex);
  if (closed) throw protocol::ProtocolError(503, "", *closed);
}

void SessionStore::List::add(Entry entry) {
  const std::lock_guard lock(mutex);
  if (closed) throw protocol::ProtocolError(503, "", *closed);  // meanwhile
  entries.push_back(std::move(entry));
}

std::vector<SessionStore::Entry>::iterator SessionStore::List::find(std::string_view id) {
  return std::find_if(entries.begin(), entries.end(),
                      [&](const Entry& entry) { return entry.session->id() == id; });
}

std::vector<std::shared_ptr<Session>> SessionStore::List::of(const std::optional<std::string>& client) const {
  const std::lock_guard lock(mutex);
  std::vector<std::shared_ptr<Session>> sessions;
  for (const Entry& entry : entries)
    if (!client || entry.client == *client) sessions.push_back(entry.session);
  return sessions;
}

std::vector<std::shared_ptr<Session>> SessionStore::all() const { return list_->of(std::nullopt); }

std::function<bool()> SessionStore::pictureRelease() const {
  return [weak = std::weak_ptr(list_)] {
    const auto list = weak.lock();
    if (!list) return false;
    std::multimap<TimePoint, std::shared_ptr<Session>> byUse;
    for (auto& session : list->of(std::nullopt)) byUse.emplace(session->lastUsed(), std::move(session));
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
  std::vector<Entry> entries;
  {
    const std::lock_guard lock(list_->mutex);
    list_->closed = reason;
    entries = std::exchange(list_->entries, {});
  }
  for (const Entry& entry : entries) entry.session->close(reason);
}

}  // namespace scolopax::server
