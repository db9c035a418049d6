// SPDX-License-Identifier: Apache-2.0
// A socket after the upgrade: one write at a time from the outbox, one message at a time to the handler.
#pragma once
#include "server/net/core.h"

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <memory>

#include "server/net/transport.h"

namespace scolopax::net {

using UpgradeRequest = boost::beast::http::request<boost::beast::http::string_body>;

/// The handle exists before the handshake, so that the upgrade handler can keep it.
class PreparedWebSocket : public WebSocket {
 public:
  /// Answers the handshake and takes over. Exactly one of start and abandon is called.
  virtual void start(Transport transport, UpgradeRequest request, WebSocketEvents events) = 0;
  /// The upgrade was refused.
  virtual void abandon() = 0;
};

/// `flow`: see Options::flowOf.
std::shared_ptr<PreparedWebSocket> prepareWebSocket(Core& core, std::string flow);

}  // namespace scolopax::net
