// SPDX-License-Identifier: Apache-2.0
#include "server/net/core.h"

#include <algorithm>

namespace scolopax::net {

Core::Core(Options given)
    : options(std::move(given)),
      files(options.staticRoot),
      tls(loadTls(options.certificateFile, options.keyFile)),
      workers(static_cast<std::size_t>(std::max(1, options.workers))),
      slowWorkers(static_cast<std::size_t>(std::max(1, options.longRequests))) {}

Response Core::problem(int status, const std::string& detail) const {
  if (options.problem) return options.problem(status, detail);
  return {status, "text/plain; charset=utf-8", detail + "\n", {}};
}

void Core::log(const std::string& line) const {
  if (options.log) options.log(line);
}

Response Core::guarded(const Handler& handler, const Request& request) const {
  std::string cause = "not a std::exception";
  try {
    return handler(request);
  } catch (const std::exception& error) {
    cause = error.what();
  } catch (...) {
  }
  log(request.method + " " + request.path + ": " + cause);
  return problem(500, "The server failed; its log says why.");
}

void Core::enter(const std::shared_ptr<Connection>& connection) {
  bool stop = false;
  bool cut = false;
  {
    const std::lock_guard lock(mutex_);
    connections_.emplace(connection.get(), connection);
    stop = stopping_;
    cut = cutting_;
  }
  if (stop) connection->beginStop();
  if (cut) connection->cut();
}

void Core::leave(Connection* connection) {
  const std::lock_guard lock(mutex_);
  connections_.erase(connection);
  // Under the lock: once the waiter has it, nothing of this core may be touched.
  left_.notify_all();
}

std::size_t Core::connectionCount() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

std::vector<std::shared_ptr<Connection>> Core::connections() const {
  std::vector<std::shared_ptr<Connection>> alive;
  for (const auto& [key, weak] : connections_) {
    if (auto connection = weak.lock()) alive.push_back(std::move(connection));
  }
  return alive;
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
