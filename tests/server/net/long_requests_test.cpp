// SPDX-License-Identifier: Apache-2.0
// Requests that take long or wait: their effect on other requests, and how they end.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include "server/net/server.h"
#include "tests/server/net/gate.h"
#include "tests/server/net/test_client.h"

namespace scolopax::net {
namespace {

using std::chrono::milliseconds;

Options onAnyPort() {
  Options options;
  options.port = 0;
  options.bodyLimit = 1000;
  return options;
}

Response passed(Gate& gate) {
  gate.pass();
  return {};
}

TEST(LongRequests, NeitherDelayOthersNorGrowWithoutBound) {
  Options options = onAnyPort();
  options.workers = 1;
  options.longRequests = 2;
  Gate gate;
  Server server(options);
  server.route(
      "GET", "/poll", [&](const Request&) { return passed(gate); }, RouteKind::takesLong);
  server.route("GET", "/quick", [](const Request&) { return Response{}; });
  server.start();
  TestClient first(server.port());
  TestClient second(server.port());
  first.send("GET /poll HTTP/1.1\r\nHost: a\r\n\r\n");
  second.send("GET /poll HTTP/1.1\r\nHost: a\r\n\r\n");
  gate.waitFor(2);
  TestClient third(server.port());
  const Answer refused = third.request("GET /poll HTTP/1.1");
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.headers.at("retry-after"), "1");
  EXPECT_EQ(third.request("GET /quick HTTP/1.1").status, 200);
  gate.open();
  EXPECT_EQ(first.answer().status, 200);
  EXPECT_EQ(second.answer().status, 200);
  EXPECT_EQ(third.request("GET /poll HTTP/1.1").status, 200);
}

TEST(LongRequests, AreNotDelayedByRequestsThatWait) {
  Options options = onAnyPort();
  options.workers = options.longRequests = 1;
  options.waitingRequests = 3;
  options.flowOf = [](const Request& request) { return request.path; };
  Gate gate;
  Server server(options);
  server.route(
      "GET", "/wait/[a-z]", [&](const Request&) { return passed(gate); }, RouteKind::waiting);
  server.route(
      "GET", "/long", [](const Request&) { return Response{}; }, RouteKind::takesLong);
  server.start();
  std::vector<std::unique_ptr<TestClient>> clients;
  for (const char* path : {"/wait/a", "/wait/b", "/wait/c", "/wait/d"}) {
    for (int i = 0; i < 3; ++i) {
      clients.push_back(std::make_unique<TestClient>(server.port()));
      clients.back()->send("GET " + std::string(path) + " HTTP/1.1\r\nHost: a\r\n\r\n");
    }
  }
  gate.waitFor(12);
  TestClient other(server.port());
  const Answer refused = other.request("GET /wait/a HTTP/1.1");
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.headers.at("retry-after"), "1");
  EXPECT_EQ(other.request("GET /long HTTP/1.1").status, 200);
  gate.open();
  for (const auto& client : clients) EXPECT_EQ(client->answer().status, 200);
  EXPECT_EQ(other.request("GET /wait/a HTTP/1.1").status, 200);
}

TEST(LongRequests, OfQuickRoutesNeitherDelayOthersNorGrowWithoutBound) {
  Options options = onAnyPort();
  options.workers = 1;
  options.longRequests = 1;
  Gate gate;
  Server server(options);
  server.route("POST", "/edit", [&](const Request& request) {
    if (request.body == "short") return Response{200, "", "at once", {}};
    if (!request.mayWait) throw TakesLong();
    gate.pass();
    return Response{200, "", request.body, {}};
  });
  server.start();
  TestClient waiting(server.port()), other(server.port());
  waiting.send("POST /edit HTTP/1.1\r\nHost: a\r\nContent-Length: 4\r\n\r\nlong");
  gate.waitFor(1);
  EXPECT_EQ(other.request("POST /edit HTTP/1.1", "short").body, "at once");
  EXPECT_EQ(other.request("POST /edit HTTP/1.1", "long").status, 503);
  gate.open();
  EXPECT_EQ(waiting.answer().body, "long");
  EXPECT_EQ(other.request("POST /edit HTTP/1.1", "long").body, "long");
}

TEST(LongRequests, OfQuickRoutesHaveAQuarterOfThePlaces) {
  Options options = onAnyPort();
  options.longRequests = 8;
  Gate gate;
  Server server(options);
  server.route("GET", "/measure", [&](const Request& request) {
    if (!request.mayWait) throw TakesLong();
    return passed(gate);
  });
  server.route(
      "GET", "/poll", [](const Request&) { return Response{}; }, RouteKind::takesLong);
  server.start();
  TestClient first(server.port()), second(server.port()), other(server.port());
  first.send("GET /measure HTTP/1.1\r\nHost: a\r\n\r\n");
  second.send("GET /measure HTTP/1.1\r\nHost: a\r\n\r\n");
  gate.waitFor(2);
  EXPECT_EQ(other.request("GET /measure HTTP/1.1").status, 503);
  EXPECT_EQ(other.request("GET /poll HTTP/1.1").status, 200);
  gate.open();
  EXPECT_EQ(first.answer().status, 200);
  EXPECT_EQ(second.answer().status, 200);
  EXPECT_EQ(other.request("GET /measure HTTP/1.1").status, 200);
}

TEST(LongRequests, OfOneFlowDelayNoOther) {
  Options options = onAnyPort();
  options.workers = 4;
  options.flowOf = [](const Request& request) { return request.path; };
  std::atomic<int> heads{0};
  options.authorize = [&](const Request&) -> std::optional<Response> { return ++heads, std::nullopt; };
  Gate gate;
  Server server(options);
  server.route("GET", "/long", [&](const Request&) { return passed(gate); });
  server.route("GET", "/other", [](const Request&) { return Response{}; });
  server.start();
  std::vector<std::unique_ptr<TestClient>> many;
  for (int i = 0; i < 40; ++i) {
    many.push_back(std::make_unique<TestClient>(server.port()));
    many.back()->send("GET /long HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  EXPECT_TRUE(eventually([&] { return heads == 40; }));
  TestClient other(server.port());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(other.request("GET /other HTTP/1.1").status, 200);
  EXPECT_EQ(gate.arrived(), 1);
  gate.open();
  for (const auto& client : many) EXPECT_EQ(client->answer().status, 200);
}

TEST(LongRequests, WithoutAFlowAreOneOfEachAddress) {
  Options options = onAnyPort();
  std::atomic<int> heads{0};
  options.authorize = [&](const Request&) -> std::optional<Response> { return ++heads, std::nullopt; };
  Gate gate;
  Server server(options);
  server.route("GET", "/long", [&](const Request&) { return passed(gate); });
  server.route("GET", "/other", [](const Request& request) { return Response{200, "", request.flow, {}}; });
  server.start();
  std::vector<std::unique_ptr<TestClient>> many;
  for (int i = 0; i < 40; ++i) {
    many.push_back(std::make_unique<TestClient>(server.port(), 0, "127.0.0.2"));
    many.back()->send("GET /long HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  EXPECT_TRUE(eventually([&] { return heads == 40; }));
  EXPECT_EQ(TestClient(server.port()).request("GET /other HTTP/1.1").body, "127.0.0.1");
  EXPECT_EQ(gate.arrived(), 1);
  gate.open();
  for (const auto& client : many) EXPECT_EQ(client->answer().status, 200);
}

TEST(LongRequests, OfAClientDelayNoPageFiles) {
  const auto folder = std::filesystem::path(testing::TempDir()) / ("page_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "index.html") << "the page";
  Options options = onAnyPort();
  options.staticRoot = folder.string();
  Gate gate;
  Server server(options);
  server.route("GET", "/long", [&](const Request&) { return passed(gate); });
  server.start();
  TestClient waiting(server.port()), other(server.port());
  waiting.send("GET /long HTTP/1.1\r\nHost: a\r\n\r\n");
  gate.waitFor(1);
  EXPECT_EQ(other.request("GET / HTTP/1.1").body, "the page");
  gate.open();
  EXPECT_EQ(waiting.answer().status, 200);
  std::filesystem::remove_all(folder);
}

TEST(LongRequests, AreToldThatTheirClientHasGone) {
  Server server(onAnyPort());
  std::atomic<int> running{0}, gone{0};
  std::atomic<bool> release{false};
  server.route(
      "POST", "/long",
      [&](const Request& request) {
        ++running;
        eventually([&] { return release || request.gone.stop_requested(); });
        if (request.gone.stop_requested()) ++gone;
        return Response{};
      },
      RouteKind::takesLong);
  server.start();
  // A client that waits is not gone, even if it has already sent its next request.
  TestClient patient(server.port());
  patient.send(
      "POST /long HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\n\r\nxPOST /long HTTP/1.1\r\nHost: a\r\n\r\n");
  for (const bool reset : {false, true}) {
    TestClient leaving(server.port());
    leaving.send("POST /long HTTP/1.1\r\nHost: a\r\n\r\n");
    ASSERT_TRUE(eventually([&] { return running == (reset ? 3 : 2); }));
    if (reset) leaving.reset();
  }
  EXPECT_TRUE(eventually([&] { return gone == 2; }));
  release = true;
  EXPECT_EQ(patient.answer().status, 200);
  EXPECT_EQ(patient.answer().status, 200);
  EXPECT_EQ(gone, 2);
}

TEST(LongRequests, GoOnWhenTheirClientOnlyStopsSending) {
  Server server(onAnyPort());
  std::atomic<bool> release{false}, gone{false};
  server.route(
      "GET", "/long",
      [&](const Request& request) {
        eventually([&] { return release || request.gone.stop_requested(); });
        gone = request.gone.stop_requested();
        return Response{};
      },
      RouteKind::takesLong);
  server.start();
  TestClient client(server.port());
  client.send("GET /long HTTP/1.1\r\nHost: a\r\n\r\n");
  client.finishSending();
  // The server sends an interim response, since a client that has closed the connection would reset it then.
  EXPECT_EQ(client.answer(true).status, 100);
  release = true;
  EXPECT_EQ(client.answer().status, 200);
  EXPECT_FALSE(gone);
  // HTTP/1.0 has no interim responses.
  release = false;
  TestClient old(server.port());
  old.send("GET /long HTTP/1.0\r\n\r\n");
  old.finishSending();
  EXPECT_EQ(old.answer().status, 200);
  EXPECT_TRUE(gone);
}

TEST(LongRequests, FinishWithinTheGraceWhenTheServerStops) {
  Gate gate;
  Server server(onAnyPort());
  server.route(
      "GET", "/poll", [&](const Request&) { return passed(gate); }, RouteKind::takesLong);
  server.start();
  TestClient idle(server.port());
  TestClient busy(server.port());
  busy.send("GET /poll HTTP/1.1\r\nHost: a\r\n\r\n");
  gate.waitFor(1);
  std::thread stopper([&] { server.stop(std::chrono::seconds(20)); });
  EXPECT_TRUE(idle.ended());
  gate.open();
  const Answer answer = busy.answer();
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.headers.at("connection"), "close");
  stopper.join();
  EXPECT_FALSE(TestClient(server.port()).connected());
}

TEST(LongRequests, AreToldWhenTheServerCutsThem) {
  Gate entered;
  entered.open();
  std::atomic<bool> gone{false};
  Server server(onAnyPort());
  server.route(
      "GET", "/poll",
      [&](const Request& request) {
        entered.pass();
        gone = eventually([&] { return request.gone.stop_requested(); });
        return Response{};
      },
      RouteKind::takesLong);
  server.start();
  TestClient waiting(server.port());
  waiting.send("GET /poll HTTP/1.1\r\nHost: a\r\n\r\n");
  entered.waitFor(1);
  server.stop(milliseconds(0));
  EXPECT_TRUE(gone);
}

}  // namespace
}  // namespace scolopax::net
