// SPDX-License-Identifier: Apache-2.0
#include "renderer/core/shared_builds.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace scolopax {
namespace {

using Builds = SharedBuilds<int, int>;

/// Blocks a build until it is opened or the build must stop.
class Gate {
 public:
  Builds::Result pass(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    ++entered;
    changed_.notify_all();
    if (!changed_.wait(lock, stop, [this] { return open_; })) {
      ++stopped;
      throw Error(ErrorCode::cancelled, "stopped");
    }
    return std::make_shared<const int>(entered);
  }
  void waitForEntry() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return entered > 0; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  int entered = 0;
  std::atomic<int> stopped{0};

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool open_ = false;
};

ErrorCode codeOf(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::io;
}

TEST(SharedBuilds, BuildOnceForAllWhoAskMeanwhileAndWhileSomebodyHoldsIt) {
  Builds builds;
  Gate gate;
  const Builds::Make make = [&](const std::stop_token& stop) { return gate.pass(stop); };
  std::vector<Builds::Result> results(5);
  {
    std::vector<std::jthread> askers;
    for (auto& result : results) askers.emplace_back([&] { result = builds.get(1, make, {}); });
    gate.waitForEntry();
    gate.open();
  }
  for (const auto& result : results) EXPECT_EQ(result, results[0]);
  EXPECT_EQ(builds.get(1, make, {}), results[0]);
  EXPECT_EQ(gate.entered, 1);
  EXPECT_NE(builds.get(2, make, {}), results[0]);
  results.clear();
  builds.get(1, make, {});
  EXPECT_EQ(gate.entered, 3);
}

TEST(SharedBuilds, EndABuildWhenTheLastWhoWaitedHasGone) {
  Builds builds;
  Gate gate;
  const Builds::Make make = [&](const std::stop_token& stop) { return gate.pass(stop); };
  std::stop_source first, second;
  ErrorCode firstCode{}, secondCode{};
  std::jthread one([&] { firstCode = codeOf([&] { builds.get(1, make, first.get_token()); }); });
  gate.waitForEntry();
  std::jthread two([&] { secondCode = codeOf([&] { builds.get(1, make, second.get_token()); }); });
  first.request_stop();
  one.join();
  second.request_stop();
  two.join();
  EXPECT_EQ(firstCode, ErrorCode::cancelled);
  EXPECT_EQ(secondCode, ErrorCode::cancelled);
  EXPECT_EQ(gate.stopped, gate.entered);  // whether the second joined the first's build or began its own
}

TEST(SharedBuilds, BeginNothingForWhoeverHasGoneAlready) {
  Builds builds;
  int begun = 0;
  const Builds::Make make = [&](const std::stop_token&) {
    ++begun;
    return std::make_shared<const int>(7);
  };
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(codeOf([&] { builds.get(1, make, stop.get_token()); }), ErrorCode::cancelled);
  EXPECT_EQ(begun, 0);
}

TEST(SharedBuilds, TellEachWhoWaitedWhyThereIsNoValueAndTryAgain) {
  Builds builds;
  const Builds::Make fail = [](const std::stop_token&) -> Builds::Result {
    throw Error(ErrorCode::tooLarge, "no memory");
  };
  EXPECT_EQ(codeOf([&] { builds.get(1, fail, {}); }), ErrorCode::tooLarge);
  const Builds::Make succeed = [](const std::stop_token&) { return std::make_shared<const int>(7); };
  EXPECT_EQ(*builds.get(1, succeed, {}), 7);
}

}  // namespace
}  // namespace scolopax
