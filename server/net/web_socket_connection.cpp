// SPDX-License-Identifier: Apache-2.0
#include "server/net/web_socket_connection.h"

#include <algorithm>
#include <array>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <optional>

#include "server/net/outbox.h"

namespace scolopax::net {
namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

/// Without compression: pictures are compressed already, and it would cost memory for each client.
using Stream = websocket::stream<Transport, false>;

constexpr std::chrono::seconds kHandshakeTimeout{5};
constexpr int kSendBufferBytes = 128 << 10;  ///< a large one hides stale frames in the kernel
constexpr std::size_t kReasonLimit = 123;    ///< RFC 6455, 5.5

/// At most the first kReasonLimit bytes, cut between two UTF-8 characters.
websocket::reason_string reasonString(const std::string& text) {
  std::size_t size = std::min(text.size(), kReasonLimit);
  while (size < text.size() && size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;
  return {text.data(), size};
}

/// The stream and the members after it are used only on the strand, and the outbox only under the mutex.
/// There is always one read in progress (the handshake counts as one) and at most one write. When both have
/// ended, so has the connection.
class WebSocketConnection : public PreparedWebSocket,
                            public Connection,
                            public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(Core& core, std::string flow)
      : io_(core.io),
        core_(core),
        flow_(std::move(flow)),
        outbox_(core.options.unsentTexts, core.unsentTexts) {}

  // The handle, from any thread.

  void sendText(SharedText text) override {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    if (!outbox_.pushText(std::move(text)))
      outbox_.close({1008, "too many messages have not been read"}, true);
    wake();
  }
  void offerFrame(Frame frame) override {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    outbox_.offer(std::move(frame));
    wake();
  }
  void withdrawFrame() override {
    const std::lock_guard lock(mutex_);
    outbox_.withdraw();
  }
  void acknowledge(std::uint32_t number) override {
    const std::lock_guard lock(mutex_);
    outbox_.acknowledge(number);
    wake();
  }
  void close(std::uint16_t code, std::string reason) override {
    const std::lock_guard lock(mutex_);
    outbox_.close({code, std::move(reason)}, false);
    wake();
  }
  WebSocketStats stats() const override {
    const std::lock_guard lock(mutex_);
    WebSocketStats stats = outbox_.stats();
    stats.open = !ended_;
    return stats;
  }

  // The server's side.

  void beginStop() override { close(1001, kStopping); }

  void cut() override {
    const std::lock_guard lock(mutex_);
    cut_ = true;
    if (strand_ && !ended_) asio::post(*strand_, [self = shared_from_this()] { self->closeSocket(); });
  }

  void abandon() override {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      outbox_.clear();
    }
    core_.leave(this);
  }

  void start(Transport transport, UpgradeRequest request, WebSocketEvents events) override {
    request_ = std::move(request);
    events_ = std::move(events);
    error_code ignored;
    transport.socket().set_option(tcp::no_delay(true), ignored);
    transport.socket().set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
    const auto executor = transport.get_executor();
    stream_.emplace(std::move(transport));
    closeTimer_.emplace(executor);
    stream_->set_option(websocket::stream_base::timeout{kHandshakeTimeout, core_.options.pingTimeout, true});
    stream_->read_message_max(std::max<std::size_t>(core_.options.messageLimit, 1));  // 0: no limit
    stream_->auto_fragment(false);
    {
      const std::lock_guard lock(mutex_);
      strand_ = executor;
      if (cut_) closeSocket();
    }
    stream_->async_accept(request_,
                          [self = shared_from_this()](const error_code& error) { self->onAccept(error); });
  }

 private:
  /// Makes the strand check the outbox. Requires the mutex.
  void wake() {
    if (!strand_ || ended_ || woken_) return;
    asio::post(*strand_, [self = shared_from_this()] { self->pump(); });
    woken_ = true;
  }

  void onAccept(const error_code& error) {
    accepted_ = !error;
    if (error) return finish();
    pump();
    read();
  }

  void read() {
    try {
      stream_->async_read(buffer_, [self = shared_from_this()](const error_code& error, std::size_t) {
        self->onRead(error);
      });
    } catch (...) {
      core_.logFailure("WebSocket");
      finish();
    }
  }

  void onRead(const error_code& error) {
    if (error) return finish();
    try {
      passOn();
    } catch (...) {
      core_.logFailure("WebSocket");
      finish();
    }
  }

  /// Passes on the message that has been read. Another one is read when it has been handled.
  void passOn() {
    if (!stream_->got_text()) {
      close(1003, "only text messages are accepted");
      buffer_.consume(buffer_.size());
      return read();
    }
    std::string text = beast::buffers_to_string(buffer_.data());
    buffer_.consume(buffer_.size());
    FairPool& workers = core_.workersFor(text.size());
    workers.post(flow_, FairPool::Job([self = shared_from_this(), text = std::move(text)]() mutable {
                   self->deliver(std::move(text));
                   asio::post(*self->strand_, [self] { self->read(); });
                 }));
  }

  void deliver(std::string text) {
    try {
      if (events_.onText) events_.onText(std::move(text));
    } catch (...) {
      core_.logFailure("WebSocket message");
      close(1011, "the server failed");
    }
  }

  void pump() {
    try {
      writeNext();
    } catch (...) {
      core_.logFailure("WebSocket");
      writing_ = false;
      closeSocket();  // which makes the read fail, too
    }
  }

  void writeNext() {
    std::optional<Outbox::Item> item;
    {
      const std::lock_guard lock(mutex_);
      woken_ = false;
      if (readEnded_ || !accepted_) return;
      if (outbox_.closing()) startCloseTimer();
      if (writing_) return;
      item = outbox_.next();
    }
    if (!item) return;
    writing_ = true;
    current_ = std::move(*item);
    const auto done = [self = shared_from_this()](const error_code& error, std::size_t = 0) {
      self->onWritten(error);
    };
    if (const auto* text = std::get_if<SharedText>(&current_)) {
      stream_->text(true);
      stream_->async_write(asio::buffer(**text), done);
    } else if (const auto* frame = std::get_if<Frame>(&current_)) {
      stream_->binary(true);
      const auto payload = frame->payload ? asio::buffer(*frame->payload) : asio::const_buffer();
      stream_->async_write(std::array<asio::const_buffer, 2>{asio::buffer(frame->header), payload}, done);
    } else {
      const auto& message = std::get<CloseMessage>(current_);
      websocket::close_reason reason(static_cast<websocket::close_code>(message.code));
      reason.reason = reasonString(message.reason);
      stream_->async_close(reason, [done, self = shared_from_this()](const error_code& error) {
        self->closeSocket();
        done(error);
      });
    }
  }

  void onWritten(const error_code& error) {
    writing_ = false;
    current_ = Outbox::Item();  // releases the text or picture
    if (readEnded_) return end();
    if (error) return closeSocket();  // which makes the read fail, too
    pump();
  }

  /// If a client does not read, the close message would wait behind the current write for ever.
  void startCloseTimer() {
    if (closeTimerStarted_) return;
    closeTimerStarted_ = true;
    closeTimer_->expires_after(kHandshakeTimeout);
    closeTimer_->async_wait([self = shared_from_this()](const error_code& error) {
      if (!error) self->closeSocket();
    });
  }

  void closeSocket() {
    if (stream_) stream_->next_layer().close();
  }

  /// The read has ended. The connection ends when the write has ended, too.
  void finish() {
    readEnded_ = true;
    closeSocket();
    closeTimer_->cancel();
    if (!writing_) end();
  }

  void end() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      outbox_.clear();
    }
    stream_.reset();
    core_.workers.post(flow_,
                       FairPool::Job([self = shared_from_this(), leaving = Leaving(core_, this)]() mutable {
                         const Leaving last = std::move(leaving);
                         try {
                           if (self->events_.onClose) self->events_.onClose();
                         } catch (...) {
                           self->core_.logFailure("WebSocket close");
                         }
                         self->events_ = {};
                       }));
  }

  std::shared_ptr<asio::io_context>
      io_;      ///< first member: handles outlive the server, and timers need it in their destructors
  Core& core_;  ///< valid until leave()
  const std::string flow_;

  mutable std::mutex mutex_;
  Outbox outbox_;
  std::optional<asio::any_io_executor> strand_;  ///< set by start()
  bool woken_ = false;
  bool cut_ = false;
  bool ended_ = false;

  std::optional<Stream> stream_;
  std::optional<asio::steady_timer> closeTimer_;
  UpgradeRequest request_;
  WebSocketEvents events_;
  beast::flat_buffer buffer_;
  Outbox::Item current_;  ///< what is being written
  bool accepted_ = false;
  bool writing_ = false;
  bool readEnded_ = false;
  bool closeTimerStarted_ = false;
};

}  // namespace

std::shared_ptr<PreparedWebSocket> prepareWebSocket(Core& core, std::string flow) {
  auto connection = std::make_shared<WebSocketConnection>(core, std::move(flow));
  core.enter(connection, "");
  core.trust(connection.get());
  return connection;
}

}  // namespace scolopax::net
