// SPDX-License-Identifier: Apache-2.0
#include "server/net/http_connection.h"

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <limits>
#include <optional>
#include <variant>

#include "server/net/client_address.h"
#include "server/net/client_watch.h"
#include "server/net/head_rules.h"
#include "server/net/transport.h"
#include "server/net/url.h"
#include "server/net/web_socket_connection.h"

namespace scolopax::net {
namespace {

namespace http = boost::beast::http;
using asio::awaitable;
using asio::ip::tcp;
using boost::system::error_code;
using Milliseconds = std::chrono::milliseconds;
using Parser = http::request_parser<http::string_body>;

constexpr std::size_t kBufferSlack = 64 << 10;
constexpr Milliseconds kLingerTime{2'000};

auto into(error_code& error) { return asio::redirect_error(asio::use_awaitable, error); }

bool isSafeHeader(const std::string& name, const std::string& value) {
  return !name.empty() && (name + value).find_first_of(std::string("\r\n\0", 3)) == std::string::npos;
}

/// Counts a request's body among the bodies that the server holds.
class HeldBody {
 public:
  explicit HeldBody(std::atomic<std::size_t>& all) : all_(all) {}
  ~HeldBody() { set(0); }
  HeldBody(const HeldBody&) = delete;
  HeldBody& operator=(const HeldBody&) = delete;
  void set(std::size_t bytes) { all_ += bytes - std::exchange(bytes_, bytes); }

 private:
  std::atomic<std::size_t>& all_;
  std::size_t bytes_ = 0;
};

class HttpConnection : public Connection, public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(Core& core, tcp::socket socket, std::string remoteAddress, bool full)
      : core_(core),
        transport_(std::move(socket), core.tls.get()),
        executor_(transport_.get_executor()),
        buffer_(core.options.headerLimit + kBufferSlack),
        remoteAddress_(std::move(remoteAddress)),
        full_(full) {}

  void beginStop() override {
    asio::post(executor_, [self = shared_from_this()] {
      if (self->idle_) self->closeSocket();
    });
  }
  void cut() override {
    asio::post(executor_, [self = shared_from_this()] { self->closeSocket(); });
  }

  static awaitable<void> run(std::shared_ptr<HttpConnection> self) {
    const Leaving leaving(self->core_, self.get());
    try {
      Milliseconds patience = self->core_.options.headTimeout;
      if (co_await self->secure()) {
        while (co_await self->exchange(patience)) patience = self->core_.options.idleTimeout;
      }
      if (self->linger_) co_await self->linger();
    } catch (...) {
      self->core_.logFailure("connection");
    }
    self->closeSocket();
  }

 private:
  /// The TLS handshake, if the server uses TLS. False if it fails.
  awaitable<bool> secure() {
    if (!transport_.tls()) co_return true;
    idle_ = true;
    if (core_.stopping()) co_return false;
    const Deadline deadline(transport_.socket(), core_.options.headTimeout);
    error_code error;
    co_await transport_.tls()->async_handshake(asio::ssl::stream_base::server, into(error));
    idle_ = false;
    co_return !error;
  }

  /// One request and its answer; false when the connection ends.
  awaitable<bool> exchange(Milliseconds patience) {
    if (!co_await waitForByte(patience)) co_return false;
    Parser parser;
    parser.header_limit(static_cast<std::uint32_t>(core_.options.headerLimit));
    // Disables the parser's own limit on bodies, which would refuse a request before it is authorised.
    // readHead() and readBody() check the limit.
    parser.body_limit(std::numeric_limits<std::uint64_t>::max());
    error_code error;
    {
      const Deadline deadline(transport_.socket(), core_.options.headTimeout);
      co_await http::async_read_header(transport_, buffer_, parser, into(error));
      if (error && deadline.expired())
        co_return co_await refuse(408, "The head of the request took too long.");
    }
    if (error) {
      if (const auto refusal = refusalOf(error)) co_return co_await refuse(refusal->status, refusal->detail);
      co_return false;
    }

    Request request;
    head_ = parser.get().method() == http::verb::head;
    version_ = parser.get().version();
    keepAlive_ = parser.keep_alive();
    const bool hasBody = parser.chunked() || parser.content_length().value_or(0) > 0;
    if (const auto refusal = readHead(parser.get(), core_.options.bodyLimit, request)) {
      co_return co_await refuse(refusal->status, refusal->detail);
    }
    request.remoteAddress = clientAddress(request.headers, remoteAddress_, core_.options.trustedProxies);
    // From here on the next request can be found, unless a body has not been read.
    const bool keepAlive = keepAlive_;
    keepAlive_ = keepAlive_ && !hasBody;
    if (full_)
      co_return co_await write(withRetry(core_.problem(503, "Too many connections; retry later.")), false);
    if (core_.options.authorize) {
      std::optional<Response> refused = authorize(request);
      if (refused) co_return co_await write(std::move(*refused), keepAlive_);
    }
    if (!core_.options.knows || core_.options.knows(request)) core_.trust(this);
    request.flow = core_.flowOf(request);
    if (boost::beast::websocket::is_upgrade(parser.get())) co_return co_await upgrade(parser, request);

    RouteMatch match = core_.router.find(request.method, request.path);
    if (!match.route && (request.method == "GET" || request.method == "HEAD") && !hasBody) {
      request.flow = "files for " + request.remoteAddress;  // a page opens while the client's calls wait
      Response file =
          co_await runOn<Response>(core_.workers, request.flow, [&] { return serveFile(request, match); });
      co_return co_await write(std::move(file), keepAlive_);
    }
    if (!match.route) co_return co_await write(noRoute(match), keepAlive_);
    HeldBody held(core_.bodyBytes);
    if (hasBody) {
      held.set(std::size_t(parser.content_length().value_or(core_.options.bodyLimit)));
      if (!co_await readBody(parser, request)) co_return false;
      held.set(request.body.size());
    }
    keepAlive_ = keepAlive;
    request.matches = std::move(match.matches);
    Response response = co_await handle(*match.route, request);
    std::string().swap(request.body);  // a client that reads slowly must not keep it in memory
    held.set(0);
    co_return co_await write(std::move(response), keepAlive_);
  }

  awaitable<bool> waitForByte(Milliseconds patience) {
    if (buffer_.size() > 0) co_return true;  // pipelined
    idle_ = true;
    if (core_.stopping()) co_return false;
    const Deadline deadline(transport_.socket(), patience);
    error_code error;
    const std::size_t count = co_await transport_.async_read_some(buffer_.prepare(4096), into(error));
    buffer_.commit(count);
    idle_ = false;
    co_return !error;
  }

  /// False if a refusal was sent instead, or if the client has disconnected.
  awaitable<bool> readBody(Parser& parser, Request& request) {
    parser.body_limit(core_.options.bodyLimit);
    error_code error;
    const Deadline deadline(transport_.socket(), core_.options.bodyTimeout);
    if (request.header("Expect") && version_ >= 11 && buffer_.size() == 0) {
      co_await asio::async_write(transport_, asio::buffer(kContinue), into(error));
    }
    if (!error) co_await http::async_read(transport_, buffer_, parser, into(error));
    if (!error) {
      request.body = std::move(parser.get().body());
      co_return true;
    }
    std::optional<Refusal> refusal = refusalOf(error);
    if (deadline.expired()) refusal = Refusal{408, "The body of the request took too long."};
    if (refusal) co_await refuse(refusal->status, refusal->detail);
    co_return false;
  }

  std::optional<Response> authorize(const Request& request) const {
    std::optional<Response> refused;
    const auto check = [&](const Request& checked) {
      refused = core_.options.authorize(checked);
      return Response{};
    };
    const Response failed = core_.guarded(check, request);
    return failed.status == 500 ? failed : refused;
  }

  Response serveFile(const Request& request, const RouteMatch& match) const {
    return core_.guarded(
        [&](const Request& asked) {
          const auto file = core_.files.find(asked.path);
          return file ? core_.files.respond(*file, asked) : noRoute(match);
        },
        request);
  }

  Response noRoute(const RouteMatch& match) const {
    if (match.allow.empty()) return core_.problem(404, "There is nothing at this path.");
    Response response = core_.problem(405, "This path supports other methods: " + match.allow + ".");
    response.headers.emplace_back("Allow", match.allow);
    return response;
  }

  static Response withRetry(Response response) {
    response.headers.emplace_back("Retry-After", "1");
    return response;
  }

  awaitable<Response> handle(const Route& route, Request& request) {
    if (route.kind == RouteKind::waiting) {
      const RequestSlots::Slot slot = core_.slots.takeWaiting(request.flow);
      if (!slot) co_return tooMany();
      const ClientWatch watch(transport_.socket(), mayBeAsked(), request);
      co_return co_await runAlone<Response>(core_.longWorkers,
                                            [&] { return core_.guarded(route.handler, request); });
    }
    if (route.kind == RouteKind::quick) {
      bool takesLong = false;
      const Handler quick = [&](const Request& asked) -> Response {
        try {
          return route.handler(asked);
        } catch (const TakesLong&) {
          takesLong = true;
          return {};
        }
      };
      Response response = co_await runOn<Response>(core_.workersFor(request.body.size()), request.flow,
                                                   [&] { return core_.guarded(quick, request); });
      if (!takesLong) co_return response;
    }
    const RequestSlots::Slot slot = core_.slots.takeLong(route.kind == RouteKind::quick);
    if (!slot) co_return tooMany();
    const ClientWatch watch(transport_.socket(), mayBeAsked(), request);
    co_return co_await runOn<Response>(core_.longWorkers,
                                       [&] { return core_.guarded(route.handler, request); });
  }

  /// See ClientWatch.
  bool mayBeAsked() { return version_ >= 11 && !transport_.tls(); }

  Response tooMany() const {
    return withRetry(core_.problem(503, "Too many long requests at once; retry later."));
  }

  awaitable<bool> upgrade(Parser& parser, const Request& request) {
    if (buffer_.size() > 0 || !parser.is_done()) {
      co_return co_await refuse(400, "Nothing may follow an upgrade request before it is answered.");
    }
    if (!originAllowed(request, core_.options.allowedOrigins)) {
      co_return co_await write(core_.problem(403, "Pages of another origin may not connect."), keepAlive_);
    }
    if (!core_.upgradeHandler)
      co_return co_await write(core_.problem(404, "There is no WebSocket here."), keepAlive_);
    const std::shared_ptr<PreparedWebSocket> socket = prepareWebSocket(core_, request.flow);
    const auto abandon = [](PreparedWebSocket* refused) { refused->abandon(); };
    std::unique_ptr<PreparedWebSocket, decltype(abandon)> unstarted(socket.get(), abandon);
    using Answer = std::variant<WebSocketEvents, Response>;
    Answer answer = co_await runOn<Answer>(core_.workers, request.flow, [&]() -> Answer {
      Answer decided;
      const auto decide = [&](const Request& asked) {
        decided = core_.upgradeHandler(asked, socket);
        return Response{};
      };
      Response failed = core_.guarded(decide, request);
      if (failed.status == 500) decided = std::move(failed);
      return decided;
    });
    if (auto* refused = std::get_if<Response>(&answer)) {
      unstarted.reset();
      co_return co_await write(std::move(*refused), keepAlive_);
    }
    socket->start(std::move(transport_), parser.release(), std::move(std::get<WebSocketEvents>(answer)));
    unstarted.release();
    co_return false;
  }

  /// Refuses a request after which the byte stream cannot be trusted: always ends the connection.
  awaitable<bool> refuse(int status, std::string_view detail) {
    Response response = core_.problem(status, std::string(detail));
    co_return co_await write(std::move(response), false);
  }

  awaitable<bool> write(Response response, bool keepAlive) {
    if (core_.options.decorate) core_.options.decorate(response);
    keepAlive = keepAlive && !core_.stopping();
    http::response<http::string_body> message(http::int_to_status(static_cast<unsigned>(response.status)),
                                              version_);
    message.result(static_cast<unsigned>(response.status));
    for (const auto& [name, value] : response.headers) {
      if (isSafeHeader(name, value)) {
        message.insert(name, value);
      } else {
        core_.log("dropped a response header that would have split the response");
      }
    }
    if (!response.contentType.empty()) message.set(http::field::content_type, response.contentType);
    const bool bodiless = response.status == 204 || response.status == 304;
    if (!bodiless) message.content_length(response.body.size());
    message.keep_alive(keepAlive);
    if (!bodiless) message.body() = std::move(response.body);

    http::response_serializer<http::string_body> serializer(message);
    serializer.split(head_);
    error_code error;
    const auto begin = std::chrono::steady_clock::now();
    std::size_t sent = 0;
    while (!error && !(head_ ? serializer.is_header_done() : serializer.is_done())) {
      const Deadline deadline(transport_.socket(), patienceFor(sent, begin));
      sent += co_await http::async_write_some(transport_, serializer, into(error));
    }
    linger_ = !error && !keepAlive;
    co_return !error && keepAlive;
  }

  /// Time for sending the next piece of an answer, after `sent` bytes. A client may take long for a large
  /// answer, but it may neither stall nor read so slowly that the answer stays in memory for hours.
  Milliseconds patienceFor(std::size_t sent, std::chrono::steady_clock::time_point begin) const {
    const Milliseconds earned(std::int64_t(sent) * 1000 / std::int64_t(core_.options.minAnswerRate));
    const auto used = std::chrono::duration_cast<Milliseconds>(std::chrono::steady_clock::now() - begin);
    const Milliseconds most = core_.options.bodyTimeout;
    return std::clamp(most + earned - used, Milliseconds(0), most);
  }

  /// Continues to read after the last answer, so that the client receives it.
  awaitable<void> linger() {
    idle_ = true;
    if (core_.stopping()) co_return;
    error_code error;
    const Deadline deadline(transport_.socket(), kLingerTime);
    co_await transport_.async_discard(into(error));
  }

  void closeSocket() { transport_.close(); }

  Core& core_;
  Transport transport_;
  asio::any_io_executor executor_;  ///< a copy, because cut() may be called after the socket has been moved
  boost::beast::flat_buffer buffer_;
  const std::string remoteAddress_;  ///< of a client or a proxy
  bool full_;
  bool idle_ = false;  ///< between requests: a server that stops does not wait
  bool linger_ = false;
  bool head_ = false;
  bool keepAlive_ = false;
  unsigned version_ = 11;
};

}  // namespace

void serveHttp(Core& core, tcp::socket socket, bool full) {
  const auto executor = socket.get_executor();
  error_code ignored;
  std::string address = socket.remote_endpoint(ignored).address().to_string();
  address = usualAddress(address).value_or(address);
  auto connection = std::make_shared<HttpConnection>(core, std::move(socket), address, full);
  Connection* const entered = connection.get();
  try {
    core.enter(connection, address);
    asio::co_spawn(executor, HttpConnection::run(std::move(connection)), asio::detached);
  } catch (...) {
    core.leave(entered);
    throw;
  }
}

}  // namespace scolopax::net
