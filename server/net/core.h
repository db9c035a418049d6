// SPDX-License-Identifier: Apache-2.0
// Everything that the connections of a server share: options, routes, threads, and the list of connections.
#pragma once
#include <utility>  // Asio 1.74 needs it first under C++20

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <condition_variable>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "server/net/fair_pool.h"
#include "server/net/request_slots.h"
#include "server/net/router.h"
#include "server/net/server.h"
#include "server/net/static_files.h"
#include "server/net/tls.h"

namespace scolopax::net {

namespace asio = boost::asio;

/// A connection. It must end before the server does. Both functions may be called from any thread.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void beginStop() = 0;  ///< finish soon, in an orderly way
  virtual void cut() = 0;        ///< close the socket now
};

class Core {
 public:
  explicit Core(Options options);

  /// A refusal by the server itself, in the format of Options::problem.
  Response problem(int status, const std::string& detail) const;
  void log(const std::string& line) const;
  /// Logs the exception that is being handled. `where`: what has thrown it.
  void logFailure(std::string_view where) const noexcept;
  /// Runs a handler; turns an exception into a log line and a 500.
  Response guarded(const Handler& handler, const Request& request) const;

  /// See Request::flow.
  std::string flowOf(const Request& request) const {
    std::string flow = options.flowOf ? options.flowOf(request) : std::string();
    return flow.empty() ? request.remoteAddress : flow;
  }

  /// A server that stops waits for this connection until it calls leave(). `address`: the client's, for
  /// makeRoom().
  void enter(const std::shared_ptr<Connection>& connection, const std::string& address);
  /// The connection's client is known. The connection is no longer cut to make room.
  void trust(Connection* connection);
  /// Whether there is room for one more connection. Strangers, whose client is not known yet, may be at most
  /// half of the connections. When they are half, or when there are as many connections as allowed, one
  /// stranger is cut: at random among those of the address that has the most. So a flood from one address
  /// cuts only itself, and a flood from many addresses cannot choose whom it cuts.
  bool makeRoom();
  /// Must be a connection's last call to the core.
  void leave(Connection* connection);
  std::size_t connectionCount() const;

  /// Runs the handlers of `io` on this thread until there is no more work. A handler that throws is logged.
  void runIo();

  bool stopping() const { return stopping_; }
  void beginStop();
  bool waitUntilEmpty(std::chrono::milliseconds patience);
  void cutAll();
  void waitUntilEmpty();

  Options options;
  Router router;
  StaticFiles files;
  const std::unique_ptr<asio::ssl::context> tls;  ///< null: plain
  UpgradeHandler upgradeHandler;
  /// Shared with WebSocket handles, which may outlive the server.
  std::shared_ptr<asio::io_context> io = std::make_shared<asio::io_context>();
  /// Bytes of texts that wait to be sent; also shared with WebSocket handles.
  std::shared_ptr<std::atomic<std::size_t>> unsentTexts = std::make_shared<std::atomic<std::size_t>>(0);
  /// Bytes of request bodies that are being received or handled. A body of unknown length counts as bodyLimit
  /// until it has been received.
  std::atomic<std::size_t> bodyBytes{0};
  FairPool workers;
  FairPool bulkWorkers;
  /// The pool for quick work on this many bytes. Large requests have their own pool and wait only for each
  /// other.
  FairPool& workersFor(std::size_t bytes) { return bytes > kBulkBytes ? bulkWorkers : workers; }
  asio::thread_pool longWorkers;
  RequestSlots slots;

 private:
  struct Entry {
    std::weak_ptr<Connection> connection;
    std::string address;
    bool stranger = true;
    bool leaving = false;  ///< it has been cut to make room
  };
  static constexpr std::size_t kBulkBytes = 64 << 10;
  std::vector<std::shared_ptr<Connection>> connections() const;

  mutable std::mutex mutex_;
  std::condition_variable left_;
  std::map<Connection*, Entry> connections_;
  std::mt19937 random_{std::random_device()()};
  std::atomic<bool> stopping_{false};
  bool cutting_ = false;
};

/// Makes a connection leave, however it ends: a server that stops would wait for it for ever.
class Leaving {
 public:
  Leaving(Core& core, Connection* connection) : core_(core), connection_(connection) {}
  Leaving(Leaving&& other) noexcept
      : core_(other.core_), connection_(std::exchange(other.connection_, nullptr)) {}
  Leaving& operator=(Leaving&&) = delete;
  ~Leaving() {
    if (connection_) core_.leave(connection_);
  }

 private:
  Core& core_;
  Connection* connection_;
};

/// Runs `work` on another thread, to which `post` passes it, and resumes the awaiting coroutine with the
/// result, or with the exception that `work` has thrown, on the coroutine's own executor. If there is not
/// even memory for that, the coroutine is destroyed.
template <typename Result, typename Post, typename Work>
asio::awaitable<Result> runBy(Post post, Work work) {
  return asio::async_initiate<const asio::use_awaitable_t<>, void(std::exception_ptr, Result)>(
      [post = std::move(post)](auto completion, Work task) {
        post([completion = std::move(completion), task = std::move(task)]() mutable {
          std::exception_ptr failure;
          Result result{};
          try {
            result = task();
          } catch (...) {
            failure = std::current_exception();
          }
          try {
            auto executor = asio::get_associated_executor(completion);
            asio::post(executor, [completion = std::move(completion), failure = std::move(failure),
                                  result = std::move(result)]() mutable {
              std::move(completion)(std::move(failure), std::move(result));
            });
          } catch (...) {
          }
        });
      },
      asio::use_awaitable, std::move(work));
}

template <typename Result, typename Work>
asio::awaitable<Result> runOn(asio::thread_pool& pool, Work work) {
  return runBy<Result>([&pool](auto job) { asio::post(pool, std::move(job)); }, std::move(work));
}

/// Runs `work` on a new thread or, if the system cannot create one, on the pool.
template <typename Result, typename Work>
asio::awaitable<Result> runAlone(asio::thread_pool& pool, Work work) {
  std::jthread thread;  // joined when its result has arrived, so joining does not wait
  co_return co_await runBy<Result>(
      [&](auto job) {
        const auto shared = std::make_shared<decltype(job)>(std::move(job));
        try {
          thread = std::jthread([shared] { (*shared)(); });
        } catch (const std::system_error&) {
          asio::post(pool, [shared] { (*shared)(); });
        }
      },
      std::move(work));
}

template <typename Result, typename Work>
asio::awaitable<Result> runOn(FairPool& pool, const std::string& flow, Work work) {
  return runBy<Result>([&pool, flow](auto job) { pool.post(flow, FairPool::Job(std::move(job))); },
                       std::move(work));
}

}  // namespace scolopax::net
