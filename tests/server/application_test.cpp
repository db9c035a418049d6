// SPDX-License-Identifier: Apache-2.0
// The whole server over its network, with fake renderers.
#include "server/application.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "renderer/core/shared_builds.h"
#include "tests/server/fakes.h"
#include "tests/server/net/gate.h"
#include "tests/server/net/test_client.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using net::Answer;
using net::eventually;
using net::Gate;
using net::TestClient;
using nlohmann::json;

/// Builds that end only when the test ends them.
struct EndlessBuilds {
  std::atomic<int> begun{0}, stopped{0};
  void operator()(const std::stop_token& stop) {
    ++begun;
    if (eventually([&] { return stop.stop_requested(); })) ++stopped;
  }
};

/// Scenes that all wait for the same endless build, until `over`.
struct WaitingBuilds {
  std::atomic<int> waiting{0};
  std::atomic<bool> over{false};
  EndlessBuilds build;
  SharedBuilds<int, int> builds;
  void operator()(const std::stop_token& stop) {
    if (over) return;
    ++waiting;
    builds.get(
        0,
        [this](const std::stop_token& abandoned) {
          build(abandoned);
          return std::make_shared<const int>(0);
        },
        stop);
  }
};

/// A server whose renderers are all controlled by the function that the test puts into `building_`.
class ApplicationTest : public ::testing::Test {
 protected:
  void start() {
    config_.port = 0;
    config_.token = kToken;
    config_.maxRenders = 1;
    std::vector<io::LoadedDataset> datasets;
    datasets.push_back({"small", "small.nrrd", {"small.nrrd"}, testing::smallVolume()});
    const auto make = [this](const std::shared_ptr<const Volume>&) {
      const auto control = std::make_shared<testing::FakeControl>();
      control->building = building_;
      if (longErrors_) control->longErrorFrom = 1;
      control->measuring = std::ref(endless_);
      control->duringPass = [this] {
        if (slowPasses_) std::this_thread::sleep_for(500ms);
      };
      ++made_;
      return std::make_unique<testing::FakeRenderer>(control);
    };
    application_.emplace(config_, std::make_shared<const DatasetStore>(std::move(datasets), memory_), make,
                         memory_, [](const std::string&) {});
    application_->start();
  }
  static std::string head(const std::string& request) {
    return request + " HTTP/1.1\r\nAuthorization: Bearer " + kToken + "\r\nContent-Type: application/json";
  }
  /// Sends a request without waiting for its answer.
  static void send(TestClient& client, const std::string& request, const std::string& body = "") {
    client.send(head(request) + "\r\nHost: localhost\r\nContent-Length: " + std::to_string(body.size()) +
                "\r\n\r\n" + body);
  }
  Answer call(const std::string& request, const std::string& body = "") {
    return TestClient(application_->port()).request(head(request), body);
  }
  std::string newSession(const std::string& body = "{}") {
    const Answer answer = call("POST /api/v1/sessions", body);
    EXPECT_EQ(answer.status, 201) << answer.body;
    return "/api/v1/sessions/" + json::parse(answer.body)["id"].get<std::string>();
  }

  static constexpr const char* kToken = "0123456789abcdef";
  Config config_;
  std::function<void(std::stop_token)> building_;
  std::atomic<bool> longErrors_{false}, slowPasses_{false};
  std::atomic<int> made_{0};
  EndlessBuilds endless_;
  WaitingBuilds waiting_;
  std::shared_ptr<MemoryBudget> memory_;
  std::optional<Application> application_;  ///< last: ends before what its renderers use
};

TEST_F(ApplicationTest, RendersSlowPassesWhileTheErrorsOfManyPicturesAreMeasured) {
  const int count = int(processors());
  config_.stopGrace = 0s;
  config_.maxSessions = std::size_t(count) + 1;
  longErrors_ = true;
  start();
  std::vector<std::unique_ptr<TestClient>> waiting;
  for (int i = 0; i < count; ++i) {
    waiting.push_back(std::make_unique<TestClient>(application_->port()));
    send(*waiting.back(), "GET " + newSession() + "/frame");
  }
  ASSERT_TRUE(eventually([&] { return made_ == count && endless_.begun >= std::max(1, count / 2); }));
  longErrors_ = false;
  slowPasses_ = true;  // so slow that they continue in the background
  EXPECT_EQ(call("GET " + newSession() + "/frame?minSamples=3").status, 200);
}

constexpr const char* kSmallPicture = R"({"image": {"width": 8, "height": 8}, "stop": {"samples": 1}})";

TEST_F(ApplicationTest, EndsAllBuildsWhenItStops) {
  config_.stopGrace = 0s;
  building_ = std::ref(endless_);
  start();
  const std::string session = newSession();
  TestClient poll(application_->port()), render(application_->port());
  send(poll, "GET " + session + "/frame");
  send(render, "POST /api/v1/render", kSmallPicture);
  ASSERT_TRUE(eventually([&] { return endless_.begun == 2; }));
  application_->stop();
  application_.reset();
  EXPECT_EQ(endless_.stopped, 2);
}

TEST_F(ApplicationTest, EndsTheBuildOfAClientThatVanishesAndFreesItsPlace) {
  std::atomic<bool> ends{false};
  building_ = [&](const std::stop_token& stop) {
    if (!ends) endless_(stop);
  };
  start();
  {
    TestClient vanishing(application_->port());
    send(vanishing, "POST /api/v1/render", kSmallPicture);
    ASSERT_TRUE(eventually([&] { return endless_.begun == 1; }));
    EXPECT_EQ(call("POST /api/v1/render", kSmallPicture).status, 503);
  }
  ends = true;
  EXPECT_TRUE(eventually([&] { return endless_.stopped == 1; }));
  EXPECT_TRUE(eventually([&] { return call("POST /api/v1/render", kSmallPicture).status == 200; }));
}

TEST_F(ApplicationTest, KeepsNobodyWaitingForTheBuildsOfOthers) {
  building_ = std::ref(waiting_);
  start();
  const int sessions = 2 * int(processors()) + 1;
  std::vector<std::unique_ptr<TestClient>> polls;
  for (int i = 0; i < sessions; ++i) {
    polls.push_back(std::make_unique<TestClient>(application_->port()));
    send(*polls.back(), "GET " + newSession() + "/frame");
  }
  ASSERT_TRUE(eventually([&] { return waiting_.waiting == sessions; }));
  EXPECT_EQ(waiting_.build.begun, 1);
  waiting_.over = true;
  EXPECT_EQ(call("GET " + newSession(R"({"scene": {"image": {"width": 8, "height": 8}}})") + "/frame").status,
            200);
  EXPECT_EQ(waiting_.build.stopped, 0);
}

TEST_F(ApplicationTest, LetsNoSessionsPollsKeepOthersOut) {
  building_ = std::ref(waiting_);
  start();
  std::vector<std::unique_ptr<TestClient>> polls;
  for (int session = 0; session < 4; ++session) {
    const std::string path = newSession();
    for (int i = 0; i < 8; ++i) {
      polls.push_back(std::make_unique<TestClient>(application_->port()));
      send(*polls.back(), "GET " + path + "/frame");
    }
  }
  ASSERT_TRUE(eventually([&] { return waiting_.waiting == 4; }));
  const std::string other = newSession();
  EXPECT_EQ(call("GET " + other + "/frame?timeout=0").status, 204);
  EXPECT_EQ(call("POST /api/v1/render", "{").status, 400);
}

TEST_F(ApplicationTest, ChargesTheAnswersToHeadAsThoseToGet) {
  memory_ = std::make_shared<MemoryBudget>(16 << 20);
  start();
  json points = json::array();
  for (int i = 0; i < 4096; ++i) points.push_back({i / 4096.0, 0.123456789});
  const std::string session =
      newSession(json{{"scene",
                       {{"image", {{"width", 64}, {"height", 64}}},
                        {"channels", {{"0", {{"opacity", points}}}, {"1", {{"opacity", points}}}}}}}}
                     .dump());
  std::uint64_t used = 64 << 10;
  for (std::size_t use = 0; use < std::size(kMemoryUses); ++use) used += memory_->used(MemoryUse(use));
  const auto full = MemoryBudget::takeShared(memory_, MemoryUse::answers, memory_->limit() - used);
  EXPECT_EQ(call("GET " + session + "/scene").status, 503);
  EXPECT_EQ(call("HEAD " + session + "/scene").status, 503);
}

}  // namespace
}  // namespace scolopax::server
