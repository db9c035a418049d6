// SPDX-License-Identifier: Apache-2.0
// What waits to be sent to one WebSocket client. The rule that the latest frame wins is implemented here,
// apart from any socket.
#pragma once
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
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
  /// Bytes of texts not sent yet, over all clients of a server; a text that many share counts for each.
  using UnsentBytes = std::shared_ptr<std::atomic<std::size_t>>;
  explicit Outbox(const TextLimits& limits,
                  UnsentBytes unsentByAll = std::make_shared<std::atomic<std::size_t>>(0))
      : limits_(limits), unsentByAll_(std::move(unsentByAll)) {}
  ~Outbox() { clear(); }
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  /// False if the text would exceed a limit: it is dropped, and the caller closes the connection.
  bool pushText(SharedText text);
  void offer(Frame frame);
  void withdraw();
  void acknowledge(std::uint32_t number);
  /// Only the first message counts. Frames are no longer sent; queued texts still are, unless `withoutTexts`.
  void close(CloseMessage message, bool withoutTexts);

  using Item = std::variant<SharedText, Frame, CloseMessage>;
  /// The next item to send; the one before it now counts as sent. Texts come first, then a frame if the
  /// window is open, and the close message last of all; nullopt if there is nothing to send now.
  std::optional<Item> next();

  /// The connection has ended: drops everything that was not sent.
  void clear();

  bool closing() const { return close_.has_value() || closeSent_; }
  const WebSocketStats& stats() const { return stats_; }

 private:
  void dropTexts();
  void release(std::size_t bytes);

  const TextLimits limits_;
  const UnsentBytes unsentByAll_;
  std::deque<SharedText> texts_;
  std::size_t unsent_ = 0;                    ///< bytes of texts_, and of the text that is being sent
  std::size_t sending_ = 0;                   ///< bytes of the text that is being sent
  std::optional<Frame> pending_;              ///< the frame in the one waiting place
  std::deque<std::uint32_t> unacknowledged_;  ///< in the order sent, at most kFrameWindow
  std::optional<CloseMessage> close_;
  bool closeSent_ = false;
  WebSocketStats stats_;
};

}  // namespace scolopax::net
