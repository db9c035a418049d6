// SPDX-License-Identifier: Apache-2.0
#include "server/net/core.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace scolopax::net {
namespace {

struct IdleConnection : Connection {
  void beginStop() override {}
  void cut() override {}
};

TEST(Core, LogsHandlersThatThrowAndGoesOn) {
  std::vector<std::string> lines;
  Options options;
  options.log = [&](const std::string& line) { lines.push_back(line); };
  Core core(options);
  bool reached = false;
  asio::post(*core.io, [] { throw std::runtime_error("why"); });
  asio::post(*core.io, [] { throw 42; });
  asio::post(*core.io, [&] { reached = true; });
  core.runIo();
  EXPECT_TRUE(reached);
  EXPECT_EQ(lines, (std::vector<std::string>{"network: why", "network: not a std::exception"}));
}

TEST(Core, IsLeftByAConnectionHoweverItEnds) {
  Core core{Options()};
  const auto connection = std::make_shared<IdleConnection>();
  core.enter(connection, "");
  try {
    const Leaving first(core, connection.get());
    EXPECT_EQ(core.connectionCount(), 1u);
    throw std::runtime_error("the end");
  } catch (const std::runtime_error&) {
    EXPECT_EQ(core.connectionCount(), 0u);
  }
  core.enter(connection, "");
  {
    Leaving leaving(core, connection.get());
    const Leaving last = std::move(leaving);
    EXPECT_EQ(core.connectionCount(), 1u);
  }
  EXPECT_EQ(core.connectionCount(), 0u);
}

}  // namespace
}  // namespace scolopax::net
