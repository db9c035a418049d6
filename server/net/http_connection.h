// SPDX-License-Identifier: Apache-2.0
// An HTTP connection: repeatedly reads a head, checks it, reads the body, calls the handler and sends the
// answer. An upgrade passes the socket to a WebSocketConnection.
#pragma once
#include "server/net/core.h"

#include <boost/asio/ip/tcp.hpp>
#include <memory>

namespace scolopax::net {

/// Starts to serve `socket`, whose executor is a strand. `full`: every request is answered with 503.
void serveHttp(Core& core, asio::ip::tcp::socket socket, bool full);

}  // namespace scolopax::net
