// SPDX-License-Identifier: Apache-2.0
#include "server/net/core.h"

#include <algorithm>

namespace scolopax::net {

namespace {
constexpr int kBulkThreads = 2;
}  // namespace

Core::Core(Options given)
    : options(std::move(given)),
      files(options.staticRoot),
      tls(loadTls(options.certificateFile, options.keyFile)),
      workers(std::max(1, options.workers), [this] { logFailure("worker"); }),
      bulkWorkers(kBulkThreads, [this] { logFailure("worker"); }),
      longWorkers(static_cast<std::size_t>(std::max(1, options.longRequests))),
      slots(options.longRequests, options.waitingRequests) {}

Response Core::problem(int status, const std::string& detail) const {
  if (options.problem) return options.problem(status, detail);
  return {status, "text/plain; charset=utf-8", detail + "\n", {}};
}

void Core::log(const std::string& line) const {
  if (options.log) options.log(line);
}

void Core::logFailure(std::string_view where) const noexcept {
  try {
    std::string cause = "not a std::exception";
    try {
      throw;
    } catch (const std::exception& error) {
      cause = error.what();
    } catch (...) {
    }
    log(std::string(where) + ": " + cause);
  } catch (...) {  // no memory for a line
  }
}

Response Core::guarded(const Handler& handler, const Request& request) const {
  try {
    return handler(request);
  } catch (...) {
    logFailure(request.method + " " + request.path);
  }
  return problem(500, "The server failed; see its log for the cause.");
}

void Core::enter(const std::shared_ptr<Connection>& connection, const std::string& address) {
  bool stop = false;
  bool cut = false;
  {
    const std::lock_guard lock(mutex_);
    connections_.emplace(connection.get(), Entry{connection, address});
    stop = stopping_;
    cut = cutting_;
  }
  if (stop) connection->beginStop();
  if (cut) connection->cut();
}

void Core::leave(Connection* connection) {
  const std::lock_guard lock(mutex_);
  connections_.erase(connection);
  // Notifies under the lock: as soon as the waiting thread holds the lock, this core may be destroyed.
  left_.notify_all();
}

void Core::trust(Connection* connection) {
  const std::lock_guard lock(mutex_);
  const auto found = connections_.find(connection);
  if (found != connections_.end()) found->second.stranger = false;
}

bool Core::makeRoom() {
  std::shared_ptr<Connection> unlucky;
  std::size_t taken = 0, strangers = 0;
  {
    const std::lock_guard lock(mutex_);
    std::map<std::string_view, std::vector<Entry*>> byAddress;
    for (auto& [key, entry] : connections_) {
      if (entry.leaving) continue;
      ++taken;
      if (!entry.stranger) continue;
      ++strangers;
      byAddress[entry.address].push_back(&entry);
    }
    const std::size_t most = options.maxConnections;
    if (strangers > 0 && (taken >= most || strangers >= std::max<std::size_t>(most / 2, 1))) {
      const auto& [address, theirs] =
          *std::max_element(byAddress.begin(), byAddress.end(),
                            [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
      Entry* entry = theirs[std::uniform_int_distribution<std::size_t>(0, theirs.size() - 1)(random_)];
      entry->leaving = true;
      unlucky = entry->connection.lock();
      --taken;
    }
  }
  if (unlucky) unlucky->cut();
  return taken < options.maxConnections;
}

std::size_t Core::connectionCount() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

std::vector<std::shared_ptr<Connection>> Core::connections() const {
  std::vector<std::shared_ptr<Connection>> alive;
  for (const auto& [key, entry] : connections_) {
    if (auto connection = entry.connection.lock()) alive.push_back(std::move(connection));
  }
  return alive;
}

void Core::runIo() {
  for (bool done = false; !done;) {
    try {
      io->run();
      done = true;
    } catch (...) {
      logFailure("network");
    }
  }
}

void Core::beginStop() {
  std::vector<std::shared_ptr<Connection>> alive;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    alive = connections();
  }
  for (const auto& connection : alive) connection->beginStop();
}

void Core::cutAll() {
  std::vector<std::shared_ptr<Connection>> alive;
  {
    const std::lock_guard lock(mutex_);
    cutting_ = true;
    alive = connections();
  }
  for (const auto& connection : alive) connection->cut();
}

bool Core::waitUntilEmpty(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  return left_.wait_for(lock, patience, [this] { return connections_.empty(); });
}

void Core::waitUntilEmpty() {
  std::unique_lock lock(mutex_);
  left_.wait(lock, [this] { return connections_.empty(); });
}

}  // namespace scolopax::net
