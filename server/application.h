// SPDX-License-Identifier: Apache-2.0
// The server as a whole: owns the data sets, the sessions, both loops and the network, and starts and stops
// them in order.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "server/config.h"
#include "server/dataset_store.h"
#include "server/progressive_render.h"

namespace scolopax::server {

class Application {
 public:
  /// An empty token in `config` is replaced by a new random one. The data sets and the renderers of
  /// `makeRenderer` must use the budget `memory`, too.
  Application(Config config, std::shared_ptr<const DatasetStore> datasets, MakeRenderer makeRenderer,
              std::shared_ptr<MemoryBudget> memory, Log log);
  ~Application();  ///< stops at once

  /// Throws net::NetError, for example when the port is taken.
  void start();
  std::uint16_t port() const;
  /// Address of the page, including the token that opens it.
  std::string url() const;
  /// Stops accepting connections, ends requests that wait and, after a grace period, those that render,
  /// closes the streams and returns. May be called twice.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::server
