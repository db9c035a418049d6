// SPDX-License-Identifier: Apache-2.0
// A connected socket, plain or with TLS. HttpConnection and WebSocketConnection read from it and write to it.
#pragma once
#include <utility>  // Asio 1.74 needs it first under C++20

#include <array>
#include <boost/asio/compose.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <memory>

namespace scolopax::net {

namespace asio = boost::asio;

/// Models Beast's AsyncStream. To be used only on the socket's strand. A moved-from transport may only be
/// closed.
class Transport {
 public:
  using executor_type = asio::ip::tcp::socket::executor_type;
  using ErrorCode = boost::system::error_code;

  /// Without `tls` the socket is plain.
  Transport(asio::ip::tcp::socket socket, asio::ssl::context* tls)
      : socket_(std::make_unique<asio::ip::tcp::socket>(std::move(socket))) {
    if (tls) tls_ = std::make_unique<asio::ssl::stream<asio::ip::tcp::socket&>>(*socket_, *tls);
  }

  executor_type get_executor() { return socket_->get_executor(); }
  asio::ip::tcp::socket& socket() { return *socket_; }
  /// Null if plain. For the TLS handshake and shutdown.
  asio::ssl::stream<asio::ip::tcp::socket&>* tls() { return tls_.get(); }

  void close() {
    ErrorCode ignored;
    if (socket_) socket_->close(ignored);
  }

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    if (tls_) return tls_->async_read_some(buffers, std::forward<Token>(token));
    return socket_->async_read_some(buffers, std::forward<Token>(token));
  }
  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    if (tls_) return tls_->async_write_some(buffers, std::forward<Token>(token));
    return socket_->async_write_some(buffers, std::forward<Token>(token));
  }

  /// To be called after the last write. Ends sending and continues to read until the peer closes,
  /// kDiscardLimit bytes have arrived, or reading fails. Closing a socket with unread bytes would reset the
  /// connection, and the client might lose the last answer.
  template <class Token>
  auto async_discard(Token&& token) {
    return asio::async_compose<Token, void(ErrorCode)>(Discard(*this), token, *socket_);
  }

  // Called by Beast's WebSocket to end and to cut a connection.
  template <class Handler>
  friend void async_teardown(boost::beast::role_type, Transport& transport, Handler&& handler) {
    transport.async_discard(std::forward<Handler>(handler));
  }
  friend void beast_close_socket(Transport& transport) { transport.close(); }

 private:
  static constexpr std::size_t kDiscardLimit = 64 << 20;

  class Discard {
   public:
    explicit Discard(Transport& transport)
        : socket_(*transport.socket_), tls_(transport.tls_.get()), state_(std::make_unique<State>()) {}

    template <class Self>
    void operator()(Self& self, ErrorCode error = {}, std::size_t count = 0) {
      if (tls_) return std::exchange(tls_, nullptr)->async_shutdown(std::move(self));
      if (!state_->begun) {
        state_->begun = true;
        socket_.shutdown(asio::ip::tcp::socket::shutdown_send, error);
      }
      state_->total += count;
      if (error || state_->total > kDiscardLimit) return self.complete({});
      const auto buffer = asio::buffer(state_->bytes);
      socket_.async_read_some(buffer, std::move(self));
    }

   private:
    struct State {
      std::array<char, 64 << 10> bytes;
      std::size_t total = 0;
      bool begun = false;
    };
    asio::ip::tcp::socket& socket_;
    asio::ssl::stream<asio::ip::tcp::socket&>* tls_;
    std::unique_ptr<State> state_;
  };

  std::unique_ptr<asio::ip::tcp::socket> socket_;
  std::unique_ptr<asio::ssl::stream<asio::ip::tcp::socket&>> tls_;
};

}  // namespace scolopax::net
