// SPDX-License-Identifier: Apache-2.0
// The upgrade, messages in both directions, latest frame wins, and the end of connections.
#include "server/net/web_socket.h"

#include <mutex>
#include <set>

#include "server/net/server.h"
#include "tests/server/net/gate.h"
#include "tests/server/net/test_client.h"

namespace scolopax::net {
namespace {

using std::chrono::milliseconds;
using Payload = std::shared_ptr<const std::vector<unsigned char>>;

Payload payload(std::size_t size) { return std::make_shared<const std::vector<unsigned char>>(size, 'p'); }

/// A frame whose header is its number in two digits.
Frame frame(std::uint32_t number, const Payload& data) {
  return {number,
          {static_cast<unsigned char>('0' + number / 10 % 10), static_cast<unsigned char>('0' + number % 10)},
          data};
}

class WebSocketTest : public testing::Test {
 protected:
  static Options quickOptions() {
    Options options;
    options.port = 0;
    options.bodyLimit = 1000;
    options.messageLimit = 1000;
    options.unsentTexts.count = 8;
    options.allowedOrigins = {"https://lab.example"};
    return options;
  }

  void start(const Options& options = quickOptions()) {
    server_ = std::make_unique<Server>(options);
    server_->route("GET", "/hello", [](const Request&) { return Response{200, "text/plain", "hello", {}}; });
    server_->upgrade([this](const Request& request,
                            std::shared_ptr<WebSocket> socket) -> std::variant<WebSocketEvents, Response> {
      if (request.path == "/throw") throw std::runtime_error("secret");
      if (request.path != "/stream") return Response{404, "text/plain", "no stream here", {}};
      socket->sendText("hello");
      const std::lock_guard lock(mutex_);
      sockets_.push_back(socket);
      const std::size_t index = sockets_.size() - 1;
      return WebSocketEvents{[this, index](const std::string& text) { onText(index, text); },
                             [this] { ++closed_; }};
    });
    server_->start();
  }

  void onText(std::size_t index, const std::string& text) {
    if (text == "throw") throw std::runtime_error("secret");
    if (text.rfind("ack ", 0) == 0) {
      socket(index)->acknowledge(static_cast<std::uint32_t>(std::stoul(text.substr(4))));
    } else {
      socket(index)->sendText("got " + text);
    }
  }

  std::shared_ptr<WebSocket> socket(std::size_t index = 0) {
    const std::lock_guard lock(mutex_);
    return sockets_.at(index);
  }
  std::uint16_t port() const { return server_->port(); }

  /// A connected client that has read the greeting.
  std::unique_ptr<TestClient> connect(int receiveBuffer = 0) {
    auto client = std::make_unique<TestClient>(port(), receiveBuffer);
    EXPECT_EQ(client->upgrade("/stream").status, 101);
    EXPECT_EQ(client->message().data, "hello");
    return client;
  }

  std::mutex mutex_;
  std::vector<std::shared_ptr<WebSocket>> sockets_;
  std::atomic<int> closed_{0};
  std::unique_ptr<Server>
      server_;  ///< last: must stop before the members that its handlers use are destroyed
};

TEST_F(WebSocketTest, FollowsRequestsOnAKeptConnection) {
  start();
  TestClient client(port());
  EXPECT_EQ(client.request("GET /hello HTTP/1.1").body, "hello");
  const Answer answer = client.upgrade("/stream");
  EXPECT_EQ(answer.status, 101);
  EXPECT_EQ(answer.headers.at("sec-websocket-accept"), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");  // RFC 6455, 1.3
  EXPECT_EQ(client.message().data, "hello");
  client.sendText("a");
  EXPECT_EQ(client.message().data, "got a");
}

TEST_F(WebSocketTest, NegotiatesNoExtension) {
  start();
  TestClient client(port());
  const Answer answer = client.upgrade("/stream", "Sec-WebSocket-Extensions: permessage-deflate\r\n");
  EXPECT_EQ(answer.status, 101);
  EXPECT_EQ(answer.headers.count("sec-websocket-extensions"), 0U);
}

TEST_F(WebSocketTest, IsRefusedOnOtherPathsAndTheConnectionGoesOn) {
  start();
  TestClient client(port());
  EXPECT_EQ(client.upgrade("/elsewhere").status, 404);
  const Answer failed = client.upgrade("/throw");
  EXPECT_EQ(failed.status, 500);
  EXPECT_EQ(failed.body.find("secret"), std::string::npos);
  EXPECT_EQ(client.upgrade("/stream").status, 101);
}

TEST_F(WebSocketTest, ChecksTheOrigin) {
  start();
  for (const char* origin : {"http://evil.example", "null", "http://localhost:1", "http://lab.example"}) {
    EXPECT_EQ(TestClient(port()).upgrade("/stream", std::string("Origin: ") + origin + "\r\n").status, 403)
        << origin;
  }
  for (const char* origin : {"http://localhost", "https://localhost", "https://lab.example"}) {
    EXPECT_EQ(TestClient(port()).upgrade("/stream", std::string("Origin: ") + origin + "\r\n").status, 101)
        << origin;
  }
}

TEST_F(WebSocketTest, NeedsAuthorisation) {
  Options options = quickOptions();
  options.authorize = [](const Request&) { return Response{401, "", "", {}}; };
  start(options);
  EXPECT_EQ(TestClient(port()).upgrade("/stream").status, 401);
}

TEST_F(WebSocketTest, RefusesBytesThatComeTooEarly) {
  start();
  TestClient client(port());
  client.send(
      "GET /stream HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n" +
      TestClient::frame(1, "early"));
  EXPECT_EQ(client.answer().status, 400);
  TestClient body(port());
  EXPECT_EQ(body.upgrade("/stream", "Content-Length: 5\r\n").status, 400);
}

TEST_F(WebSocketTest, NeedsAWholeHandshake) {
  start();
  TestClient post(port());
  EXPECT_EQ(post.request("POST /stream HTTP/1.1\r\nConnection: Upgrade\r\nUpgrade: websocket").status, 404);
  TestClient old(port());
  EXPECT_EQ(old.request("GET /stream HTTP/1.1\r\nConnection: Upgrade\r\nUpgrade: "
                        "websocket\r\nSec-WebSocket-Version: 8\r\n"
                        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==")
                .status,
            426);
  EXPECT_TRUE(eventually([&] { return closed_ == 1; }));
}

TEST_F(WebSocketTest, AnswersPingAndClose) {
  start();
  auto client = connect();
  client->send(TestClient::frame(9, "ping"));
  const Message pong = client->message();
  EXPECT_EQ(pong.opcode, 10);
  EXPECT_EQ(pong.data, "ping");
  client->send(TestClient::frame(8, "\x03\xE8"));
  EXPECT_EQ(client->closeCode(), 1000);
  EXPECT_TRUE(client->ended());
  client.reset();
  EXPECT_TRUE(eventually([&] { return closed_ == 1; }));
  EXPECT_FALSE(socket()->stats().open);
}

TEST_F(WebSocketTest, SendsFramesAsOneBinaryMessageOfHeaderAndPayload) {
  start();
  const auto client = connect();
  socket()->offerFrame(frame(7, payload(200'000)));
  const Message message = client->message();
  EXPECT_EQ(message.opcode, 2);
  EXPECT_EQ(message.data, "07" + std::string(200'000, 'p'));
}

TEST_F(WebSocketTest, ClosesOnMessagesItDoesNotTake) {
  start();
  const std::vector<std::pair<std::string, int>> cases{{TestClient::frame(1, std::string(1001, 'x')), 1009},
                                                       {TestClient::frame(2, "x"), 1003},
                                                       {TestClient::frame(1, "\xFF\xFE"), 1007},
                                                       {"\x81\x01x", 1002},  // not masked
                                                       {TestClient::frame(1, "throw"), 1011}};
  for (const auto& [bytes, code] : cases) {
    const auto client = connect();
    client->sendText(std::string(1000, 'x'));
    EXPECT_EQ(client->message().data.size(), 1004U);
    client->send(bytes);
    EXPECT_EQ(client->closeCode(), code);
  }
  EXPECT_TRUE(eventually([&] { return closed_ == 5; }));
}

TEST_F(WebSocketTest, SaysWhyItClosesToAClientThatGoesOnSending) {
  start();
  for (const std::string& first :
       {TestClient::frame(1, std::string(8 << 20, 'x')), TestClient::frame(2, "x")}) {
    const auto client = connect();
    // More than the sockets' buffers hold: sending completes only if the server reads it.
    EXPECT_TRUE(client->send(first));
    EXPECT_TRUE(client->send(TestClient::frame(1, std::string(8 << 20, 'x'))));
    EXPECT_EQ(client->closeCode(), first.size() > 1000 ? 1009 : 1003);
  }
}

TEST_F(WebSocketTest, SendsWhatIsQueuedBeforeItCloses) {
  start();
  const auto client = connect();
  socket()->sendText("last");
  socket()->close(4001, std::string(121, 'x') + "\xC3\xBC\xC3\xBC");
  EXPECT_EQ(client->message().data, "last");
  const Message message = client->message();
  EXPECT_EQ(message.closeCode(), 4001);
  EXPECT_EQ(message.data.substr(2), std::string(121, 'x') + "\xC3\xBC") << "cut between characters";
  socket()->sendText("after the end");
  socket()->offerFrame(frame(1, nullptr));
  socket()->acknowledge(1);
  socket()->close(1000, "");
}

TEST_F(WebSocketTest, SendsTwoFramesUnacknowledgedAndThenTheLatest) {
  start();
  const auto client = connect();
  const Payload data = payload(10);
  for (std::uint32_t number = 1; number <= 2; ++number) {
    socket()->offerFrame(frame(number, data));
    EXPECT_EQ(std::stoul(client->message().data.substr(0, 2)), number);
  }
  for (std::uint32_t number = 3; number <= 9; ++number) socket()->offerFrame(frame(number, data));
  client->sendText("ack 77");
  client->sendText("ack 0");
  client->sendText("x");
  EXPECT_EQ(client->message().data, "got x") << "no frame passes on excess acknowledgements";
  client->sendText("ack 2");
  EXPECT_EQ(client->message().data.substr(0, 2), "09");
  const WebSocketStats stats = socket()->stats();
  EXPECT_EQ(stats.framesSent, 3U);
  EXPECT_EQ(stats.framesReplaced, 6U);
  EXPECT_EQ(stats.unacknowledged, 1);
  EXPECT_FALSE(stats.framePending);
}

TEST_F(WebSocketTest, SendsNoFrameThatWasWithdrawnWhileItWaited) {
  start();
  const auto client = connect();
  const Payload data = payload(10);
  for (std::uint32_t number = 1; number <= 3; ++number) socket()->offerFrame(frame(number, data));
  // Frames 1 and 2 fill the window, so frame 3 waits (or 2 was replaced and 3 sent). The client leaves its
  // session.
  socket()->withdrawFrame();
  socket()->offerFrame(frame(4, data));
  client->sendText("ack 1");
  client->sendText("ack 2");
  std::string last;
  for (int i = 0; i < 3 && last != "04"; ++i) last = client->message().data.substr(0, 2);
  EXPECT_EQ(last, "04");
  EXPECT_FALSE(socket()->stats().framePending);
}

TEST_F(WebSocketTest, AStalledClientCostsOthersNothing) {
  Options options = quickOptions();
  options.pingTimeout = milliseconds(3'000);
  start(options);
  const auto stalled = connect(4096);
  const auto reader = connect();
  const Payload data = payload(2 << 20);
  constexpr std::uint32_t kFrames = 20;
  for (std::uint32_t number = 1; number <= kFrames; ++number) {
    socket(0)->offerFrame(frame(number, data));
    socket(1)->offerFrame(frame(number, data));
    EXPECT_EQ(std::stoul(reader->message().data.substr(0, 2)), number);
    reader->sendText("ack " + std::to_string(number));
    ASSERT_TRUE(eventually([&] { return socket(1)->stats().unacknowledged == 0; }));
  }
  const WebSocketStats stats = socket(0)->stats();
  EXPECT_LE(stats.framesSent, 2U);
  EXPECT_EQ(stats.framesSent + stats.framesReplaced + (stats.framePending ? 1 : 0), kFrames);
  EXPECT_LE(data.use_count(), 4) << "ours, one being written, one pending: memory does not grow";
  EXPECT_EQ(socket(1)->stats().framesReplaced, 0U);

  EXPECT_TRUE(eventually([&] { return !socket(0)->stats().open; })) << "the ping timeout ends it";
  EXPECT_TRUE(eventually([&] { return data.use_count() == 1; })) << "and lets go of its frames";
  EXPECT_TRUE(eventually([&] { return closed_ >= 1; }));
}

TEST_F(WebSocketTest, AClientThatAnswersPingsStays) {
  Options options = quickOptions();
  options.pingTimeout = milliseconds(200);
  start(options);
  const auto client = connect();
  for (int i = 0; i < 5; ++i) {
    const Message ping = client->message();
    ASSERT_EQ(ping.opcode, 9);
    client->send(TestClient::frame(10, ping.data));
  }
  EXPECT_TRUE(socket()->stats().open);
}

TEST_F(WebSocketTest, OverflowingControlQueueClosesTheConnection) {
  start();
  auto client = connect(4096);
  // The large frame fills the socket, so that texts wait behind it.
  socket()->offerFrame(frame(1, payload(8 << 20)));
  ASSERT_TRUE(eventually([&] { return socket()->stats().framesSent == 1; }));
  for (int i = 0; i < 9; ++i) socket()->sendText("waits");
  EXPECT_EQ(client->closeCode(), 1008);
  client.reset();
  EXPECT_TRUE(eventually([&] { return closed_ == 1; }));
}

TEST_F(WebSocketTest, TextFloodWithoutReadingEndsTheFloodersConnectionOnly) {
  start();
  const auto other = connect();
  const auto flooder = connect(4096);
  const std::string burst = TestClient::frame(1, std::string(990, 'x'));
  EXPECT_TRUE(eventually([&] {
    for (int i = 0; i < 200 && flooder->send(burst); ++i) continue;
    return !socket(1)->stats().open;
  }));
  other->sendText("still here");
  EXPECT_EQ(other->message().data, "got still here");
}

TEST_F(WebSocketTest, StreamsOfOneFlowThatTakeLongDelayNoOther) {
  Options options = quickOptions();
  options.flowOf = [](const Request& request) { return request.path; };
  Gate gate;
  Server server(options);
  server.upgrade([&](const Request& request, const std::shared_ptr<WebSocket>& socket) {
    const bool slow = request.path == "/slow";
    return WebSocketEvents{[&gate, slow, weak = std::weak_ptr(socket)](const std::string& text) {
                             if (slow) gate.pass();
                             if (const auto open = weak.lock()) open->sendText("got " + text);
                           },
                           {}};
  });
  server.start();
  std::vector<std::unique_ptr<TestClient>> slow;
  for (int i = 0; i < 8; ++i) {
    slow.push_back(std::make_unique<TestClient>(server.port()));
    EXPECT_EQ(slow.back()->upgrade("/slow").status, 101);
  }
  TestClient other(server.port());
  EXPECT_EQ(other.upgrade("/other").status, 101);
  for (const auto& client : slow) client->sendText("edit");
  gate.waitFor(1);
  for (int i = 0; i < 3; ++i) {
    other.sendText("edit");
    EXPECT_EQ(other.message().data, "got edit");
  }
  EXPECT_EQ(gate.arrived(), 1);
  gate.open();
  for (const auto& client : slow) EXPECT_EQ(client->message().data, "got edit");
}

TEST_F(WebSocketTest, SurvivesAbruptEndsWhileFramesAreOffered) {
  start();
  std::atomic<bool> done{false};
  std::thread renderer([&] {
    const Payload data = payload(100'000);
    for (std::uint32_t number = 1; !done; ++number) {
      std::vector<std::shared_ptr<WebSocket>> sockets;
      {
        const std::lock_guard lock(mutex_);
        sockets = sockets_;
      }
      for (const auto& one : sockets) {
        one->offerFrame(frame(number, data));
        one->sendText("n");
      }
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  constexpr int kClients = 60;
  for (int i = 0; i < kClients; ++i) {
    const auto client = connect();
    client->sendText("ack 1");
    if (i % 3 == 0) client->reset();
    if (i % 3 == 1) client->send("garbage that is no frame");
  }
  EXPECT_TRUE(eventually([&] { return closed_ == kClients; })) << closed_;
  done = true;
  renderer.join();
}

TEST_F(WebSocketTest, StopSaysGoingAwayAndCutsWhoStalls) {
  start();
  const auto reader = connect();
  const auto stalled = connect(4096);
  TestClient half(port());
  half.send("GET /stream HTTP/1.1\r\nUpgr");
  socket(1)->offerFrame(frame(1, payload(8 << 20)));
  ASSERT_TRUE(eventually([&] { return socket(1)->stats().framesSent == 1; }));
  std::thread stopper([&] { server_->stop(milliseconds(300)); });
  EXPECT_EQ(reader->closeCode(), 1001);
  reader->send(TestClient::frame(8, "\x03\xE9"));
  stopper.join();
  EXPECT_EQ(closed_, 2) << "every onClose ran before stop returned";
}

TEST_F(WebSocketTest, StopWaitsForNobodyWhoseHandlersThrowAnything) {
  std::mutex mutex;
  std::string logged;
  Options options = quickOptions();
  options.log = [&](const std::string& line) {
    const std::lock_guard lock(mutex);
    logged += line + "\n";
  };
  Server server(options);
  server.upgrade([](const Request&, const std::shared_ptr<WebSocket>&) {
    return WebSocketEvents{[](const std::string&) { throw 1; }, [] { throw 2; }};
  });
  server.start();
  TestClient client(server.port());
  EXPECT_EQ(client.upgrade("/stream").status, 101);
  client.sendText("anything");
  EXPECT_EQ(client.closeCode(), 1011);
  TestClient other(server.port());
  EXPECT_EQ(other.upgrade("/stream").status, 101);
  server.stop(milliseconds(50));
  EXPECT_EQ(logged,
            "WebSocket message: not a std::exception\nWebSocket close: not a std::exception\n"
            "WebSocket close: not a std::exception\n");
}

TEST_F(WebSocketTest, StopWaitsForNoUpgradeThatCouldNotBeRefused) {
  Options options = quickOptions();
  options.problem = [](int, const std::string&) -> Response { throw std::runtime_error("no refusal"); };
  start(options);
  TestClient client(port());
  EXPECT_EQ(client.upgrade("/throw").status, 0);
  server_->stop(milliseconds(50));
}

TEST_F(WebSocketTest, HandlesOutliveTheServer) {
  start();
  const auto client = connect();
  const std::shared_ptr<WebSocket> kept = socket();
  {
    const std::lock_guard lock(mutex_);
    sockets_.clear();
  }
  server_.reset();
  kept->sendText("nobody");
  kept->offerFrame(frame(1, payload(10)));
  kept->acknowledge(1);
  kept->close(1000, "");
  EXPECT_FALSE(kept->stats().open);
  EXPECT_EQ(closed_, 1);
}

}  // namespace
}  // namespace scolopax::net
