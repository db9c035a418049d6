// SPDX-License-Identifier: Apache-2.0
// A socket after the upgrade. Writes the outbox's items one at a time, and passes messages to the handler one
// at a time.
#pragma once
#include "server/net/core.h"

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <memory>

#include "server/net/transport.h"

namespace scolopax::net {

using UpgradeRequest = boost::beast::http::request<boost::beast::http::string_body>;

/// The handle of the connection. It exists before the handshake, so that the upgrade handler can keep it.
class PreparedWebSocket : public WebSocket {
 public:
  /// Answers the handshake and serves the connection. Exactly one of start and abandon is called.
  virtual void start(Transport transport, UpgradeRequest request, WebSocketEvents events) = 0;
  /// The upgrade was refused.
  virtual void abandon() = 0;
};

/// `flow`: see Options::flowOf.
std::shared_ptr<PreparedWebSocket> prepareWebSocket(Core& core, std::string flow);

}  // namespace scolopax::net
