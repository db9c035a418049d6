// SPDX-License-Identifier: Apache-2.0
// A client's WebSocket on a session: receives text messages, sends frames and texts. Connects net/ with
// Session.
#pragma once
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "protocol/json_text.h"
#include "server/background.h"
#include "server/fair_places.h"
#include "server/metrics.h"
#include "server/net/web_socket.h"
#include "server/session_store.h"

namespace scolopax::server {

class Stream;

/// All open streams. Must outlive the connections.
class StreamHub {
 public:
  struct Options {
    std::size_t maxClients;
    protocol::Limits limits;
    nlohmann::json capabilities;  ///< for hello
    std::function<void(const std::string&)> log;
    Now now;
  };
  /// `background` runs the measurements for which edits wait.
  StreamHub(SessionStore& store, Background& background, Metrics& metrics, Options options);
  ~StreamHub();

  /// Joins the socket to the session as a viewer and returns the handlers of its events. `client`: address of
  /// the client that has the stream's place (FairPlaces). Throws ProtocolError(503) if the maximum number of
  /// streams is reached. If another client has more than half of them then, its newest stream is closed with
  /// 1013.
  net::WebSocketEvents join(const std::shared_ptr<Session>& session,
                            const std::shared_ptr<net::WebSocket>& socket, const std::string& client = "");
  /// Adds the frame counts of the open streams to the metrics.
  void countFrames();
  std::size_t count() const;

 private:
  struct Entry {
    std::shared_ptr<Stream> stream;
    std::string client;  ///< its address
    FairPlaces::Place place;
  };
  void left(const Stream* stream);
  void closeNewestOf(const std::string& client);

  SessionStore& store_;
  Background& background_;
  Metrics& metrics_;
  const Options options_;
  FairPlaces places_;
  mutable std::mutex mutex_;
  std::vector<Entry> streams_;  ///< the oldest first
};

}  // namespace scolopax::server
