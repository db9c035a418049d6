// SPDX-License-Identifier: Apache-2.0
// Watches a client while HttpConnection waits: whether its time is up, and whether it has disconnected.
#pragma once
#include <utility>  // Asio 1.74 needs it first under C++20

#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <memory>
#include <string_view>

#include "server/net/message.h"

namespace scolopax::net {

inline constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";

/// Cancels the operations of the socket when the time is up. It repeats this while it exists, because a
/// composed operation may be between two steps at that moment.
class Deadline {
 public:
  Deadline(boost::asio::ip::tcp::socket& socket, std::chrono::milliseconds time);
  ~Deadline();
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;
  bool expired() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// Lets a request wait, and detects soon that the client or the server has closed the connection. It polls
/// the system, since reading would consume bytes of the next request. A client may also close only its
/// sending side and wait for the answer. `mayAsk`: with plain HTTP/1.1, the two cases can be distinguished.
class ClientWatch {
 public:
  ClientWatch(boost::asio::ip::tcp::socket& socket, bool mayAsk, Request& request);
  ~ClientWatch();
  ClientWatch(const ClientWatch&) = delete;
  ClientWatch& operator=(const ClientWatch&) = delete;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace scolopax::net
