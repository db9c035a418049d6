// SPDX-License-Identifier: Apache-2.0
// All sessions. A session ends some time after its last viewer has left.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/fair_places.h"
#include "server/session.h"

namespace scolopax::server {

class SessionStore {
 public:
  struct Options {
    std::size_t maxSessions;
    std::chrono::milliseconds keep;  ///< after the last viewer, edit or request
  };
  /// Time after which a session counts as unused.
  static constexpr std::chrono::seconds kUnused{10};

  SessionStore(std::shared_ptr<const SceneResolver> resolver, Options options, SessionHooks hooks);

  /// `client`: address of the client that has the session's place (FairPlaces). Throws ProtocolError: 503 if
  /// the maximum number of sessions is reached or all have been closed, 422 for an invalid scene. Throws
  /// Unmeasured until the data that the scene needs has been measured. If another client has more than half
  /// of the sessions and there is no place, the one of those that has been unused for the longest ends,
  /// provided that it has been unused for kUnused.
  std::shared_ptr<Session> create(const nlohmann::json& scene, const std::string& client = "");
  /// nullptr if there is none.
  std::shared_ptr<Session> find(std::string_view id) const;
  std::shared_ptr<Session> findByToken(std::string_view token) const;
  /// Ends the session; false if there is none with this id.
  bool remove(std::string_view id);
  /// All sessions, in the order of their creation.
  std::vector<std::shared_ptr<Session>> all() const;
  /// A function that calls Session::dropPicture() of the sessions until one has released a picture, beginning
  /// with the one that has been unused for longest; false if none has. It may be called from any thread, even
  /// after the store has ended.
  std::function<bool()> pictureRelease() const;
  /// Ends the sessions that have expired; returns when the next one may expire.
  std::optional<TimePoint> expire();
  /// Ends all sessions. From then on create() throws, with this reason.
  void closeAll(const std::string& reason);

 private:
  struct Entry {
    std::shared_ptr<Session> session;
    std::string client;  ///< its address
    FairPlaces::Place place;
  };
  struct List {
    mutable std::mutex mutex;  ///< guards the members below
    std::vector<Entry> entries;
    std::optional<std::string> closed;  ///< the reason, after closeAll()

    void throwIfClosed() const;
    void add(Entry entry);                                   ///< throws as throwIfClosed()
    std::vector<Entry>::iterator find(std::string_view id);  ///< requires the mutex
    /// The sessions of a client, or of all.
    std::vector<std::shared_ptr<Session>> of(const std::optional<std::string>& client) const;
  };
  bool endUnusedOf(const std::string& client);

  const std::shared_ptr<const SceneResolver> resolver_;
  const Options options_;
  const SessionHooks hooks_;
  FairPlaces places_;
  const std::shared_ptr<List> list_ = std::make_shared<List>();
};

}  // namespace scolopax::server
