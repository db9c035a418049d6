// SPDX-License-Identifier: Apache-2.0
#include "server/net/server.h"

#include "server/net/core.h"
#include "server/net/http_connection.h"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <thread>

namespace scolopax::net {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

constexpr int kIoThreads = 2;
/// Number of connections beyond the limit that get a 503. Further ones are closed without an answer.
constexpr std::size_t kRefusedAtOnce = 32;
constexpr std::chrono::milliseconds kAcceptPause{50};

}  // namespace

struct Server::Impl {
  explicit Impl(Options options)
      : core(std::move(options)),
        strand(asio::make_strand(*core.io)),
        acceptor(strand),
        work(core.io->get_executor()) {}

  void bind() {
    const Options& options = core.options;
    const std::string where = options.host + ":" + std::to_string(options.port);
    error_code error;
    tcp::resolver resolver(*core.io);
    const auto found = resolver.resolve(options.host, std::to_string(options.port),
                                        tcp::resolver::passive | tcp::resolver::numeric_service, error);
    if (error || found.empty()) throw NetError("cannot listen on " + where + ": no such host");
    const tcp::endpoint endpoint = found.begin()->endpoint();
    acceptor.open(endpoint.protocol(), error);
    // Lets a restarted server bind the port at once. Unlike SO_REUSEPORT, it does not let two servers share
    // the port.
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error == asio::error::address_in_use) {
      throw NetError("cannot listen on " + where +
                     ": another program uses this port; choose a different one, or 0 for any free port");
    }
    if (error) throw NetError("cannot listen on " + where + ": " + error.message());
    boundPort = acceptor.local_endpoint().port();
  }

  asio::awaitable<void> accept() {
    bool failed = false;
    while (acceptor.is_open() && !core.stopping()) {
      try {
        if (std::exchange(failed, false)) {
          error_code ignored;
          asio::steady_timer pause(strand, kAcceptPause);
          co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
        }
        failed = !co_await acceptOne();
      } catch (...) {
        failed = true;
        core.logFailure("accept");
      }
    }
  }

  /// False if the next connection should be accepted after a pause only.
  asio::awaitable<bool> acceptOne() {
    error_code error;
    tcp::socket socket = co_await acceptor.async_accept(asio::make_strand(*core.io),
                                                        asio::redirect_error(asio::use_awaitable, error));
    if (error == asio::error::operation_aborted || core.stopping()) co_return true;
    if (error) {
      // Probably out of file descriptors: existing connections continue, and some of them will end.
      core.log("accept: " + error.message());
      co_return false;
    }
    const bool full = !core.makeRoom();
    if (core.connectionCount() >= core.options.maxConnections + kRefusedAtOnce) co_return true;
    socket.set_option(tcp::no_delay(true), error);
    serveHttp(core, std::move(socket), full);
    co_return true;
  }

  Core core;
  asio::strand<asio::io_context::executor_type> strand;
  tcp::acceptor acceptor;
  asio::executor_work_guard<asio::io_context::executor_type> work;
  std::vector<std::thread> threads;
  std::uint16_t boundPort = 0;
  std::mutex stopMutex;
  bool stopped = false;
};

Server::Server(Options options) : impl_(std::make_unique<Impl>(std::move(options))) {}

Server::~Server() { stop(std::chrono::milliseconds(0)); }

void Server::route(const std::string& method, const std::string& pattern, Handler handler, RouteKind kind) {
  impl_->core.router.add(method, pattern, {std::move(handler), kind});
}

void Server::upgrade(UpgradeHandler handler) { impl_->core.upgradeHandler = std::move(handler); }

void Server::start() {
  impl_->bind();
  asio::co_spawn(impl_->strand, impl_->accept(), asio::detached);
  for (int i = 0; i < kIoThreads; ++i) impl_->threads.emplace_back([this] { impl_->core.runIo(); });
}

std::uint16_t Server::port() const { return impl_->boundPort; }

std::size_t Server::unreadTextBytes() const { return *impl_->core.unsentTexts; }

std::size_t Server::requestBodyBytes() const { return impl_->core.bodyBytes; }

void Server::stop(std::chrono::milliseconds grace) {
  const std::lock_guard lock(impl_->stopMutex);
  if (impl_->stopped) return;
  impl_->stopped = true;
  asio::post(impl_->strand, [this] {
    error_code ignored;
    impl_->acceptor.close(ignored);
  });
  impl_->core.beginStop();
  if (!impl_->core.waitUntilEmpty(grace)) {
    impl_->core.cutAll();
    impl_->core.waitUntilEmpty();
  }
  impl_->work.reset();
  // io->stop() is not called: only cancelled timers are left, and running them frees them.
  for (std::thread& thread : impl_->threads) thread.join();
  impl_->core.workers.join();
  impl_->core.bulkWorkers.join();
  impl_->core.longWorkers.join();
}

}  // namespace scolopax::net
