// SPDX-License-Identifier: Apache-2.0
// What HttpConnection knows of a client while it waits: whether its time is up, and whether it has gone.
#pragma once
#include <utility>  // Asio 1.74 needs it first under C++20

#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <memory>
#include <string_view>

#include "server/net/message.h"

namespace scolopax::net {

inline constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";

/// While this object lives and its time is up, cancels whatever the socket waits for. It does so repeatedly:
/// a composed operation may be just between two steps when the time is up.
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

/// Lets a request wait, and notices soon that its client has closed the connection, or the server has. It
/// polls the system, since reading would consume bytes of the next request. A client may also close only its
/// sending side and wait for the answer. `mayAsk`: plain HTTP/1.1, where the two can be told apart.
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
