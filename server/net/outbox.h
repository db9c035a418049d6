// SPDX-License-Identifier: Apache-2.0
// What one WebSocket client is still to be sent. Latest frame wins is decided here, away from any socket.
#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <variant>

#include "server/net/web_socket.h"

namespace scolopax::net {

struct CloseMessage {
  std::uint16_t code = 1000;
  std::string reason;
};

/// Not thread-safe. One consumer calls next() whenever the socket is free for another write.
class Outbox {
 public:
  explicit Outbox(std::size_t textLimit) : textLimit_(textLimit) {}

  /// False when the queue is full: the text is dropped, and the caller closes the connection.
  bool pushText(std::string text);
  void offer(Frame frame);
  void withdraw();
  void acknowledge(std::uint32_t number);
  /// The first one counts. Frames no longer go out, texts still do, unless `dropTexts`.
  void close(CloseMessage message, bool dropTexts);

  using Item = std::variant<std::string, Frame, CloseMessage>;
  /// Texts first, then a frame if the window is open, the close message last of all; nullopt: nothing now.
  std::optional<Item> next();

  /// The connection has ended: nothing is kept that could not be sent.
  void clear();

  bool closing() const { return close_.has_value() || closeSent_; }
  const WebSocketStats& stats() const { return stats_; }

 private:
  std::size_t textLimit_;
  std::deque<std::string> texts_;
  std::optional<Frame> pending_;              ///< the one waiting place
  std::deque<std::uint32_t> unacknowledged_;  ///< in the order sent, at most kFrameWindow
  std::optional<CloseMessage> close_;
  bool closeSent_ = false;
  WebSocketStats stats_;
};

}  // namespace scolopax::net
