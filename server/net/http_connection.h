// SPDX-License-Identifier: Apache-2.0
// One accepted socket while it speaks HTTP: reads a head, checks it, reads the body, calls the handler, sends
// the answer, and repeats. An upgrade passes the socket on to a WebSocketConnection.
#pragma once
#include "server/net/core.h"

#include <boost/asio/ip/tcp.hpp>
#include <memory>

namespace scolopax::net {

/// Starts to serve `socket`, whose executor is a strand. `full`: every request is answered with 503.
void serveHttp(Core& core, asio::ip::tcp::socket socket, bool full);

}  // namespace scolopax::net
