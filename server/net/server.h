// SPDX-License-Identifier: Apache-2.0
// HTTP and WebSocket on one port: owns sockets, limits, deadlines and threads, and knows nothing about what
// is served. Routes and the upgrade handler are set before start().
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

/// The server cannot be set up: the message names the address, file or route and says what is wrong.
class NetError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Options {
  std::string host = "127.0.0.1";  ///< name or address; the first address it resolves to is bound
  std::uint16_t port = 8080;       ///< 0: any free one

  std::size_t headerLimit = 16 << 10;  ///< bytes of a request's head; beyond: 431
  std::size_t bodyLimit = 4 << 20;     ///< bytes of a request's body; beyond: 413
  std::size_t messageLimit = 1 << 20;  ///< bytes of a WebSocket message; beyond: closed with 1009
  TextLimits unsentTexts;
  /// Beyond: 503. At most half of them may be strangers, whose client is not known yet (`knows`).
  std::size_t maxConnections = 512;
  int workers = 4;           ///< threads for ordinary handlers and WebSocket events, which flows share fairly
  int longRequests = 16;     ///< long requests at once, at most a quarter from quick routes; beyond: 503
  int waitingRequests = 16;  ///< requests of one flow that wait at once; beyond: 503

  std::chrono::milliseconds headTimeout{5'000};   ///< from the first byte of a head to its end
  std::chrono::milliseconds idleTimeout{30'000};  ///< between the requests of a kept connection
  std::chrono::milliseconds bodyTimeout{30'000};  ///< to read a whole body; to write a piece of a response
  /// Bytes per second of a response that a client must read on average, after bodyTimeout; a slower one is
  /// cut.
  std::size_t minAnswerRate = 64 << 10;
  std::chrono::milliseconds pingTimeout{20'000};  ///< a WebSocket client silent for this long is cut

  std::vector<std::string> allowedOrigins;  ///< in addition to the server's own, e.g. "https://lab.example"
  std::string staticRoot;                   ///< folder of the page; empty: none

  /// PEM files: the certificate with its chain, and its key. With both, the server speaks only TLS; with
  /// neither, it speaks none.
  std::string certificateFile, keyFile;

  /// Called first for every request and upgrade, on an I/O thread, before the body is read: must be quick and
  /// thread-safe. Returning a Response refuses the request.
  std::function<std::optional<Response>(const Request&)> authorize;
  /// Whether a request that passed `authorize` comes from a known client; if not set, every one does.
  std::function<bool(const Request&)> knows;
  /// The flow that a request, or the messages of the WebSocket that it opens, belong to: handlers of one flow
  /// run one at a time, and flows take turns (FairPool). Called as `authorize` is. Requests for which it
  /// returns "" are one flow for each client's address, as all are if this is not set.
  std::function<std::string(const Request&)> flowOf;
  /// Formats the server's own refusals (404, 405, 413, ...).
  std::function<Response(int status, const std::string& detail)> problem;
  /// Called last on every response, e.g. to add security headers.
  std::function<void(Response&)> decorate;
  /// Receives one line about what a client must not be told.
  std::function<void(const std::string&)> log;
};

/// Throws NetError unless the files can serve as Options::certificateFile and keyFile. Meant to be called
/// before long work, such as loading data.
void checkTlsFiles(const std::string& certificateFile, const std::string& keyFile);

/// quick: handlers may neither wait nor compute for long, except for single requests (TakesLong). takesLong:
/// handlers may compute for long; they have places of their own (Options::longRequests). waiting: handlers
/// wait most of the time (long poll); each request has a thread of its own and takes nobody's place.
enum class RouteKind { quick, takesLong, waiting };

class Server {
 public:
  explicit Server(Options options);  ///< throws NetError for files that cannot be used
  ~Server();                         ///< stops at once
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// `pattern` is an ECMAScript regex for the whole path. A GET route answers HEAD too. The first pattern
  /// that fits the path wins, and decides which methods there are.
  void route(const std::string& method, const std::string& pattern, Handler handler,
             RouteKind kind = RouteKind::quick);
  /// Without it every upgrade is refused with 404.
  void upgrade(UpgradeHandler handler);

  /// Binds and serves on threads of its own; throws NetError, e.g. when the port is taken.
  void start();
  std::uint16_t port() const;  ///< the one bound, after start()

  /// Bytes of texts that WebSocket clients have not read.
  std::size_t unreadTextBytes() const;
  /// Bytes of request bodies that are being received or handled.
  std::size_t requestBodyBytes() const;

  /// Accepts no more connections, closes WebSockets with 1001, and lets requests finish; after `grace`, cuts
  /// the connections that are left. Handlers must return by themselves: this waits for the last one. Safe to
  /// call twice.
  void stop(std::chrono::milliseconds grace);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::net
