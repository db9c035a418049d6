// SPDX-License-Identifier: Apache-2.0
#include "server/stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "protocol/problem.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using nlohmann::json;
using testing::FakeViewer;
using testing::Workshop;

/// Stores the texts and frames that it gets, but fails for texts that contain `refused`.
struct FakeSocket : net::WebSocket {
  std::string refused = "nothing";
  std::vector<net::SharedText> texts;
  int frames = 0;
  std::uint16_t closed = 0;

  void sendText(net::SharedText text) override {
    if (text->find(refused) != std::string::npos) throw std::runtime_error("no memory for this text");
    texts.push_back(std::move(text));
  }
  void offerFrame(net::Frame) override { ++frames; }
  void withdrawFrame() override {}
  void acknowledge(std::uint32_t) override {}
  void close(std::uint16_t code, std::string) override { closed = code; }
  net::WebSocketStats stats() const override { return {}; }
};

/// A session with a client, whose log is kept.
struct Client {
  Workshop workshop;
  Metrics metrics;
  std::vector<std::string> log;
  StreamHub hub{
      workshop.store,
      workshop.background,
      metrics,
      {8, {}, json::object(), [this](const std::string& line) { log.push_back(line); }, workshop.hooks.now}};
  std::shared_ptr<Session> session = workshop.store.create(json::object());
  std::shared_ptr<FakeSocket> socket = std::make_shared<FakeSocket>();
  net::WebSocketEvents events = hub.join(session, socket);
  ~Client() { events.onClose(); }
};

constexpr const char* kPick = R"({"type": "pick", "id": 3, "x": 1, "y": 1})";

TEST(Stream, EndsWhenAnAnswerToAPickCannotBeSent) {
  Client client;
  const auto other = std::make_shared<FakeViewer>();
  client.session->addViewer(other);
  client.workshop.step();
  client.socket->refused = "picked";
  client.events.onText(kPick);
  client.workshop.steps(2);
  EXPECT_EQ(client.socket->closed, 1011);
  EXPECT_EQ(client.log.size(), 1u);
  EXPECT_TRUE(other->failures.empty());
}

TEST(Stream, EndsWhenTheFailureOfAPickCannotBeSent) {
  Client client;
  client.workshop.step();
  client.socket->refused = "picked";
  client.events.onText(kPick);
  client.session->fail(1, Error(ErrorCode::busy, "no memory"));
  EXPECT_EQ(client.socket->closed, 1011);
}

TEST(Stream, LeavesNoPickBehind) {
  Client client;
  client.events.onText(kPick);
  EXPECT_TRUE(client.session->request().pick);
  client.events.onClose();
  EXPECT_FALSE(client.session->request().pick);
}

TEST(Stream, IsToldThatItsPickEndedWhenItGoesToAnotherSession) {
  Client client;
  client.events.onText(kPick);
  const auto other = client.workshop.store.create(json::object());
  client.events.onText(json{{"type", "resume"}, {"token", other->token()}}.dump());
  const auto isPicked = [](const net::SharedText& text) {
    const auto message = json::parse(*text);
    return message["type"] == "picked" && message["id"] == 3 && message["problem"]["status"] == 409;
  };
  EXPECT_EQ(std::count_if(client.socket->texts.begin(), client.socket->texts.end(), isPicked), 1);
}

TEST(Stream, SharesTheTextAboutAnEditWithTheOthers) {
  Client client;
  const auto other = std::make_shared<FakeSocket>();
  const net::WebSocketEvents events = client.hub.join(client.session, other);
  client.session->patch(testing::seedPatch(4), {});
  EXPECT_NE(client.socket->texts.back()->find("revision"), std::string::npos);
  EXPECT_EQ(client.socket->texts.back(), other->texts.back());
  events.onClose();
}

TEST(Stream, OfAClientThatHasMostOfThemIsClosedForAnotherClient) {
  Workshop workshop;
  Metrics metrics;
  StreamHub hub{
      workshop.store, workshop.background, metrics, {4, {}, json::object(), {}, workshop.hooks.now}};
  const auto session = workshop.store.create(json::object());
  std::vector<std::shared_ptr<FakeSocket>> sockets;
  std::vector<net::WebSocketEvents> joined;
  const auto join = [&](const char* client) {
    sockets.push_back(std::make_shared<FakeSocket>());
    try {
      joined.push_back(hub.join(session, sockets.back(), client));
      return true;
    } catch (const protocol::ProtocolError& error) {
      EXPECT_EQ(error.status, 503);
      return false;
    }
  };
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(join("a"));
  EXPECT_FALSE(join("a"));
  EXPECT_EQ(sockets[3]->closed, 0);
  EXPECT_FALSE(join("b"));
  EXPECT_EQ(sockets[3]->closed, 1013);
  EXPECT_EQ(sockets[2]->closed, 0);
  joined[3].onClose();
  EXPECT_FALSE(join("a"));  // the place is kept
  EXPECT_TRUE(join("b"));
  EXPECT_EQ(hub.count(), 4u);
  for (const std::size_t i : {0, 1, 2, 4}) joined[i].onClose();
}

TEST(Stream, EndsWhenTheOthersEditsCannotBeSent) {
  Client client;
  client.socket->refused = "revision";
  client.session->patch(testing::seedPatch(4), {});
  EXPECT_EQ(client.socket->closed, 1011);
}

}  // namespace
}  // namespace scolopax::server
