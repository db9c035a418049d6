// SPDX-License-Identifier: Apache-2.0
// The messages that wait to be sent to one WebSocket client. Implements the rule that the latest frame wins;
// uses no socket.
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

/// Not thread-safe. One consumer calls next() whenever the socket is ready for another write.
class Outbox {
 public:
  /// Bytes of unsent texts over all clients of a server; a shared text counts for each client.
  using UnsentBytes = std::shared_ptr<std::atomic<std::size_t>>;
  explicit Outbox(const TextLimits& limits,
                  UnsentBytes unsentByAll = std::make_shared<std::atomic<std::size_t>>(0))
      : limits_(limits), unsentByAll_(std::move(unsentByAll)) {}
  ~Outbox() { clear(); }
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  /// False if the text would exceed a limit. It is then dropped, and the caller must close the connection.
  bool pushText(SharedText text);
  void offer(Frame frame);
  void withdraw();
  void acknowledge(std::uint32_t number);
  /// Only the first call has an effect. Frames are no longer sent; queued texts are, unless `withoutTexts`.
  void close(CloseMessage message, bool withoutTexts);

  using Item = std::variant<SharedText, Frame, CloseMessage>;
  /// The next item to send; the previous one now counts as sent. Texts come first, then the close message,
  /// then a frame if the window is open. nullopt if there is nothing to send now.
  std::optional<Item> next();

  /// To be called when the connection has ended: drops everything that has not been sent.
  void clear();

  bool closing() const { return close_.has_value() || closeSent_; }
  const WebSocketStats& stats() const { return stats_; }

 private:
  void dropTexts();
  void release(std::size_t bytes);

  const TextLimits limits_;
  const UnsentBytes unsentByAll_;
  std::deque<SharedText> texts_;
  std::size_t unsent_ = 0;                    ///< bytes of texts_ and of the text that is being sent
  std::size_t sending_ = 0;                   ///< bytes of the text that is being sent
  std::optional<Frame> pending_;              ///< the one frame that waits
  std::deque<std::uint32_t> unacknowledged_;  ///< in the order sent, at most kFrameWindow
  std::optional<CloseMessage> close_;
  bool closeSent_ = false;
  WebSocketStats stats_;
};

}  // namespace scolopax::net
