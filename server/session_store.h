// SPDX-License-Identifier: Apache-2.0
// The sessions there are. A session outlives its viewers for a while and then ends.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/session.h"

namespace scolopax::server {

class SessionStore {
 public:
  struct Options {
    std::size_t maxSessions = 32;
    std::chrono::milliseconds keep{300'000};  ///< after the last viewer, edit or request
  };
  SessionStore(std::shared_ptr<const SceneResolver> resolver, Options options, SessionHooks hooks);

  /// Throws ProtocolError: 503 when there are as many as there may be, 422 for a scene that is none; and
  /// Unmeasured until what the scene needs of the data is measured.
  std::shared_ptr<Session> create(const nlohmann::json& scene);
  /// nullptr when there is none.
  std::shared_ptr<Session> find(std::string_view id) const;
  std::shared_ptr<Session> findByToken(std::string_view token) const;
  /// Ends it; false when there is none.
  bool remove(std::string_view id);
  /// In the order of their creation.
  std::vector<std::shared_ptr<Session>> all() const;
  /// Ends the sessions whose time is over; returns when the next one's may be.
  std::optional<TimePoint> expire();
  void closeAll(const std::string& reason);

 private:
  const std::shared_ptr<const SceneResolver> resolver_;
  const Options options_;
  const SessionHooks hooks_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<Session>> sessions_;
};

}  // namespace scolopax::server
