// SPDX-License-Identifier: Apache-2.0
// HTTP and WebSocket on one port: owns sockets, limits, deadlines and threads, but does not know what is
// served. Routes and the upgrade handler are set before start().
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

/// The server cannot be set up. The message names the address, file or route and says what is wrong.
class NetError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Options {
  std::string host = "127.0.0.1";  ///< name or address; the first address it resolves to is bound
  std::uint16_t port = 8080;       ///< 0: any free one

  std::size_t headerLimit = 16 << 10;  ///< bytes of a request's head; beyond: 431
  std::size_t bodyLimit = 0;           ///< bytes of a request's body; beyond: 413
  std::size_t messageLimit = 0;        ///< bytes of a WebSocket message; beyond: closed with 1009
  TextLimits unsentTexts;
  /// Beyond: 503. At most half may be strangers, whose client is not known yet (`knows`).
  std::size_t maxConnections = 512;
  int workers = 4;           ///< threads for ordinary handlers and WebSocket events, which flows share fairly
  int longRequests = 16;     ///< long requests at once, at most a quarter from quick routes; beyond: 503
  int waitingRequests = 16;  ///< requests of one flow that wait at once; beyond: 503

  std::chrono::milliseconds headTimeout{5'000};   ///< from the first byte of a head to its end
  std::chrono::milliseconds idleTimeout{30'000};  ///< between two requests on a connection
  std::chrono::milliseconds bodyTimeout{30'000};  ///< to read a whole body; to write a piece of a response
  /// Bytes per second of a response that a client must read on average, apart from one bodyTimeout. A slower
  /// client is cut.
  std::size_t minAnswerRate = 64 << 10;
  std::chrono::milliseconds pingTimeout{20'000};  ///< a WebSocket client silent for this long is cut

  std::vector<std::string> allowedOrigins;  ///< in addition to the server's own, e.g. "https://lab.example"
  /// Addresses, as usualAddress() writes them, of proxies whose X-Forwarded-For names the client
  /// (clientAddress()).
  std::vector<std::string> trustedProxies;
  std::string staticRoot;  ///< folder of the page; empty: none

  /// PEM files: the certificate with its chain, and its key. With both, the server speaks only TLS; with
  /// neither, it speaks none.
  std::string certificateFile, keyFile;

  /// Called first for every request and upgrade, on an I/O thread, before the body is read. Must be quick and
  /// thread-safe. A returned Response refuses the request.
  std::function<std::optional<Response>(const Request&)> authorize;
  /// Whether a request that passed `authorize` comes from a known client. If not set, all clients are known.
  std::function<bool(const Request&)> knows;
  /// The flow of a request and of the messages of the WebSocket that it opens. Handlers of one flow run one
  /// at a time, and flows take turns (FairPool). Called like `authorize`. If it returns "" or is not set, the
  /// flow is the client's address. Files of the page are a flow of their own for each address.
  std::function<std::string(const Request&)> flowOf;
  /// Formats the server's own refusals (404, 405, 413, ...).
  std::function<Response(int status, const std::string& detail)> problem;
  /// Called last on every response, e.g. to add security headers.
  std::function<void(Response&)> decorate;
  /// Receives a line that clients must not see.
  std::function<void(const std::string&)> log;
};

/// Throws NetError unless the files can be used as Options::certificateFile and keyFile. To be called before
/// long work such as loading data.
void checkTlsFiles(const std::string& certificateFile, const std::string& keyFile);

/// quick: handlers may neither wait nor compute for long, except for single requests (TakesLong). takesLong:
/// handlers may compute for long; Options::longRequests limits their number. waiting: handlers wait most of
/// the time (long poll); each request has a thread of its own.
enum class RouteKind { quick, takesLong, waiting };

class Server {
 public:
  explicit Server(Options options);  ///< throws NetError if files cannot be used
  ~Server();                         ///< stops at once
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// `pattern` is an ECMAScript regex for the whole path. A GET route also answers HEAD. The first pattern
  /// that matches the path determines the allowed methods.
  void route(const std::string& method, const std::string& pattern, Handler handler,
             RouteKind kind = RouteKind::quick);
  /// Without it, every upgrade is refused with 404.
  void upgrade(UpgradeHandler handler);

  /// Binds and serves on its own threads. Throws NetError, for example if the port is taken.
  void start();
  std::uint16_t port() const;  ///< the bound port, after start()

  /// Bytes of texts that WebSocket clients have not read.
  std::size_t unreadTextBytes() const;
  /// Bytes of request bodies that are being received or handled.
  std::size_t requestBodyBytes() const;

  /// Stops accepting connections, closes WebSockets with 1001 and lets requests finish. After `grace`, cuts
  /// the remaining connections. Waits for the last handler, so handlers must return by themselves. May be
  /// called twice.
  void stop(std::chrono::milliseconds grace);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::net
