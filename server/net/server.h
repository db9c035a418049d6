// SPDX-License-Identifier: Apache-2.0
// HTTP and WebSocket on one port: owns sockets, limits, deadlines and threads, and knows nothing of what
// is served. Routes and the upgrade handler are given before start().
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/net/message.h"
#include "server/net/web_socket.h"

namespace scolopax::net {

/// The server cannot be set up: the message names address, file or route and says what is wrong.
class NetError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Options {
  std::string host = "127.0.0.1";  ///< name or address; the first that it resolves to is bound
  std::uint16_t port = 8080;       ///< 0: any free one

  std::size_t headerLimit = 16 << 10;  ///< bytes of a request's head; beyond: 431
  std::size_t bodyLimit = 4 << 20;     ///< bytes of a request's body; beyond: 413
  std::size_t messageLimit = 1 << 20;  ///< bytes of a WebSocket message; beyond: closed with 1009
  TextLimits unsentTexts;
  /// Beyond: 503. Half of them at most may be strangers', who have shown no token yet.
  std::size_t maxConnections = 512;
  int workers = 4;  ///< threads for ordinary handlers and WebSocket events
  /// Long requests at once; those of quick routes (TakesLong) may take a quarter of the slots. Beyond: 503.
  int longRequests = 16;

  std::chrono::milliseconds headTimeout{5'000};   ///< from the first byte of a head to its end
  std::chrono::milliseconds idleTimeout{30'000};  ///< between the requests of a kept connection
  std::chrono::milliseconds bodyTimeout{30'000};  ///< to read a whole body; to write a whole response
  std::chrono::milliseconds pingTimeout{20'000};  ///< a WebSocket client silent for this long is cut

  std::vector<std::string> allowedOrigins;  ///< beside the own one, e.g. "https://lab.example"
  std::string staticRoot;                   ///< folder of the page; empty: none

  /// PEM: the certificate with its chain, and its key. With both only TLS is spoken, with neither none.
  std::string certificateFile, keyFile;

  /// Called first for every request and upgrade, on an I/O thread, before the body is read: must be quick and
  /// thread-safe. A Response refuses.
  std::function<std::optional<Response>(const Request&)> authorize;
  /// Whether a request that `authorize` let pass comes from somebody known; not set: each does.
  std::function<bool(const Request&)> knows;
  /// Formats the server's own refusals (404, 405, 413, ...).
  std::function<Response(int status, const std::string& detail)> problem;
  /// Last touch on every response, e.g. security headers.
  std::function<void(Response&)> decorate;
  /// Receives one line about what a client must not be told.
  std::function<void(const std::string&)> log;
};

/// Throws NetError unless files can serve as Options::certificateFile and keyFile: to be asked before long
/// work.
void checkTlsFiles(const std::string& certificateFile, const std::string& keyFile);

/// slow: may wait or compute for long (long poll, render); has threads of its own, so that it delays nobody.
/// quick: may not, but for single requests (TakesLong).
enum class RouteKind { quick, slow };

class Server {
 public:
  explicit Server(Options options);  ///< throws NetError for files that cannot be used
  ~Server();                         ///< stops at once
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// `pattern` is an ECMAScript regex for the whole path. A GET route answers HEAD too. First match wins.
  void route(const std::string& method, const std::string& pattern, Handler handler,
             RouteKind kind = RouteKind::quick);
  /// Without it every upgrade is refused with 404.
  void upgrade(UpgradeHandler handler);

  /// Binds and serves on threads of its own; throws NetError, e.g. when the port is taken.
  void start();
  std::uint16_t port() const;  ///< the one bound, after start()

  /// Accepts no more, closes WebSockets with 1001, lets requests end; after `grace` cuts what is left.
  /// Handlers must return by themselves: this waits for the last one. Safe to call twice.
  void stop(std::chrono::milliseconds grace);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::net
