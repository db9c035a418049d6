// SPDX-License-Identifier: Apache-2.0
// A WebSocket client. It gets texts in order, and the latest picture. The session offers each frame when it
// is encoded; the connection sends as many as the client can receive.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "server/net/message.h"

namespace scolopax::net {

/// One binary message: `header` is this client's own, `payload` is shared by all clients that see the
/// picture.
struct Frame {
  std::uint32_t number = 0;  ///< for acknowledgement; differs from the numbers not yet acknowledged
  std::vector<unsigned char> header;
  std::shared_ptr<const std::vector<unsigned char>> payload;  ///< may be null
};

/// Limits on the texts that wait to be sent. A connection that exceeds them is closed with 1008.
struct TextLimits {
  std::size_t count = 256;            ///< texts for one client
  std::size_t bytes = 4 << 20;        ///< of the texts for one client; a single text may be longer
  std::size_t bytesOfAll = 64 << 20;  ///< of the texts for all clients together, even single ones
  std::size_t fairBytes =
      256 << 10;  ///< always allowed for one client, even if all together exceed bytesOfAll
};

struct WebSocketStats {
  std::uint64_t framesSent = 0;
  std::uint64_t framesReplaced = 0;  ///< offered, but replaced by a newer one before they were sent
  std::uint64_t textsSent = 0;
  int unacknowledged = 0;     ///< 0 .. kFrameWindow
  bool framePending = false;  ///< a frame waits for the window or the socket
  bool open = true;
};

/// A text that many clients may share.
using SharedText = std::shared_ptr<const std::string>;

/// Number of frames that may be on their way to a client: enough to keep the connection busy, and few enough
/// that they are not outdated.
inline constexpr int kFrameWindow = 2;

/// Every function may be called from any thread and at any time; after the connection has ended it does
/// nothing.
class WebSocket {
 public:
  virtual ~WebSocket() = default;
  /// Queued in order; beyond Options::unsentTexts the connection is closed with 1008.
  virtual void sendText(SharedText text) = 0;
  void sendText(std::string text) { sendText(std::make_shared<const std::string>(std::move(text))); }
  /// Makes this the frame that waits to be sent, replacing an earlier one.
  virtual void offerFrame(Frame frame) = 0;
  /// Withdraws a frame that still waits, because the client views something else now.
  virtual void withdrawFrame() = 0;
  /// The client has shown `number` and thereby all frames sent before it; anything else is ignored.
  virtual void acknowledge(std::uint32_t number) = 0;
  /// Sends the queued texts, then the close frame. `reason` is cut to 123 bytes.
  virtual void close(std::uint16_t code, std::string reason) = 0;
  virtual WebSocketStats stats() const = 0;
};

/// Called on a worker thread, one at a time per connection; the next message is read when onText has
/// returned. An exception from onText closes the connection with 1011. These functions may hold a WebSocket
/// only by a weak pointer.
struct WebSocketEvents {
  std::function<void(std::string)> onText;  ///< valid UTF-8; binary messages close with 1003
  std::function<void()> onClose;            ///< called exactly once, last, whatever ended the connection
};

/// Runs on a worker thread before the handshake is answered. A returned Response refuses the upgrade. Texts
/// and frames that are given to the socket here are sent right after the handshake.
using UpgradeHandler =
    std::function<std::variant<WebSocketEvents, Response>(const Request&, std::shared_ptr<WebSocket>)>;

}  // namespace scolopax::net
