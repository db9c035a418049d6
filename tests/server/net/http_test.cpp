// SPDX-License-Identifier: Apache-2.0
// HTTP as seen by well-behaved and other clients.
#include <fcntl.h>
#include <sys/resource.h>

#include <atomic>
#include <mutex>
#include <new>

#include "server/net/server.h"
#include "tests/server/net/test_client.h"

namespace scolopax::net {
namespace {

using std::chrono::milliseconds;

class HttpTest : public testing::Test {
 protected:
  static Options quickOptions() {
    Options options;
    options.port = 0;
    options.bodyLimit = 1000;
    options.problem = [](int status, const std::string& detail) {
      return Response{status, "application/problem+json", "{" + detail + "}", {}};
    };
    return options;
  }

  void start(Options options = quickOptions()) {
    server_ = std::make_unique<Server>(std::move(options));
    server_->route("GET", "/hello/([a-z]+)", [](const Request& request) {
      return Response{200, "text/plain", "hello " + request.matches.at(1), {{"X-Extra", "1"}}};
    });
    server_->route("POST", "/echo", [this](const Request& request) {
      ++echoes_;
      return Response{200, "text/plain", request.method + " " + request.body, {}};
    });
    server_->route("GET", "/query", [](const Request& request) {
      return Response{200,
                      "text/plain",
                      *request.queryValue("a") + *request.header("x-thing") + request.remoteAddress,
                      {}};
    });
    const auto fails = [](const Request&) -> Response { throw std::runtime_error("the secret cause"); };
    server_->route("GET", "/throw", fails);
    for (const RouteKind kind : {RouteKind::quick, RouteKind::takesLong, RouteKind::waiting})
      server_->route("GET", "/throw/" + std::to_string(int(kind)), fails, kind);
    server_->route("GET", "/split", [](const Request&) {
      return Response{200, "text/plain", "x", {{"X-Bad", "a\r\nX-Injected: b"}}};
    });
    server_->route("GET", "/large", [](const Request&) {
      return Response{200, "", std::string(3 << 20, 'x'), {}};
    });
    server_->start();
  }
  std::uint16_t port() const { return server_->port(); }

  /// Status of the answer to raw bytes; the connection must end after it.
  int refusal(const std::string& raw) {
    TestClient client(port());
    client.send(raw);
    const Answer answer = client.answer();
    EXPECT_TRUE(client.ended()) << raw.substr(0, 80);
    EXPECT_EQ(answer.headers.count("content-type"), 1U);
    return answer.status;
  }

  std::atomic<int> echoes_{0};
  std::mutex logMutex_;
  std::string logged_;
  std::unique_ptr<Server> server_;
};

constexpr const char* kPost = "POST /echo HTTP/1.1\r\nHost: a\r\n";

TEST_F(HttpTest, AnswersManyRequestsOnOneConnection) {
  start();
  TestClient client(port());
  for (int i = 0; i < 3; ++i) {
    const Answer answer = client.request("GET /hello/you HTTP/1.1");
    EXPECT_EQ(answer.status, 200);
    EXPECT_EQ(answer.body, "hello you");
    EXPECT_EQ(answer.headers.at("content-type"), "text/plain");
    EXPECT_EQ(answer.headers.at("x-extra"), "1");
    EXPECT_EQ(client.request("POST /echo HTTP/1.1", "body").body, "POST body");
  }
}

TEST_F(HttpTest, ClosesWhenTheClientAsksForIt) {
  start();
  TestClient client(port());
  EXPECT_EQ(client.request("GET /hello/you HTTP/1.1\r\nConnection: close").status, 200);
  EXPECT_TRUE(client.ended());
  TestClient old(port());
  EXPECT_EQ(old.request("GET /hello/you HTTP/1.0").status, 200);
  EXPECT_TRUE(old.ended());
}

TEST_F(HttpTest, AnswersPipelinedRequestsInOrder) {
  start();
  TestClient client(port());
  std::string all;
  for (const char* name : {"a", "b", "c"})
    all += std::string("GET /hello/") + name + " HTTP/1.1\r\nHost: a\r\n\r\n";
  client.send(all + kPost + "Content-Length: 4\r\n\r\nbodyGET /hello/d HTTP/1.1\r\nHost: a\r\n\r\n");
  for (const char* body : {"hello a", "hello b", "hello c", "POST body", "hello d"})
    EXPECT_EQ(client.answer().body, body);
}

TEST_F(HttpTest, SendsNoBodyToHead) {
  start();
  TestClient client(port());
  const Answer answer = client.request("HEAD /hello/you HTTP/1.1");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.headers.at("content-length"), "9");
  EXPECT_EQ(client.request("GET /hello/you HTTP/1.1").body, "hello you");
}

TEST_F(HttpTest, HandsOnQueryHeadersAndTheRealAddress) {
  start();
  TestClient client(port());
  EXPECT_EQ(client.request("GET /query?a=1%202 HTTP/1.1\r\nX-Thing: t\r\nREMOTE_ADDR: 6.6.6.6").body,
            "1 2t127.0.0.1");
}

TEST_F(HttpTest, KnowsAClientBehindATrustedProxyByItsOwnAddress) {
  Options options = quickOptions();
  options.trustedProxies = {"127.0.0.1"};
  start(options);
  const std::string head = "GET /query?a=1 HTTP/1.1\r\nX-Thing: t\r\nX-Forwarded-For: 6.6.6.6, 192.0.2.7";
  TestClient proxy(port()), other(port(), 0, "127.0.0.2");
  EXPECT_EQ(proxy.request(head).body, "1t192.0.2.7");
  EXPECT_EQ(proxy.request(head + ", unknown").body, "1t127.0.0.1");
  EXPECT_EQ(other.request(head).body, "1t127.0.0.2");
}

TEST_F(HttpTest, LimitsDoNotReachBodiesThatTheRouterWouldParse) {
  Options options = quickOptions();
  options.bodyLimit = 1 << 20;
  start(options);
  TestClient client(port());
  for (const char* type : {"application/x-www-form-urlencoded", "multipart/form-data; boundary=x"}) {
    const std::string body(100'000, 'a');
    EXPECT_EQ(client.request(std::string("POST /echo HTTP/1.1\r\nContent-Type: ") + type, body).body,
              "POST " + body);
  }
}

TEST_F(HttpTest, SendsALargeAnswerWhole) {
  start();
  TestClient client(port());
  EXPECT_EQ(client.request("GET /large HTTP/1.1").body, std::string(3 << 20, 'x'));
}

TEST_F(HttpTest, SaysNotFoundAndWhichMethodsThereAre) {
  start();
  TestClient client(port());
  const Answer missing = client.request("GET /none HTTP/1.1");
  EXPECT_EQ(missing.status, 404);
  EXPECT_EQ(missing.headers.at("content-type"), "application/problem+json");
  const Answer wrong = client.request("DELETE /echo HTTP/1.1");
  EXPECT_EQ(wrong.status, 405);
  EXPECT_EQ(wrong.headers.at("allow"), "POST");
  EXPECT_EQ(client.request("BREW /echo HTTP/1.1").status, 501);
}

TEST_F(HttpTest, KeepsTheCauseOfAFailureToTheLog) {
  Options options = quickOptions();
  options.log = [this](const std::string& line) {
    const std::lock_guard lock(logMutex_);
    logged_ += line;
  };
  start(options);
  TestClient client(port());
  const Answer answer = client.request("GET /throw HTTP/1.1");
  EXPECT_EQ(answer.status, 500);
  EXPECT_EQ(answer.body.find("secret"), std::string::npos);
  for (const auto& [name, value] : answer.headers)
    EXPECT_EQ((name + value).find("secret"), std::string::npos);
  {
    const std::lock_guard lock(logMutex_);
    EXPECT_NE(logged_.find("the secret cause"), std::string::npos);
  }
  EXPECT_EQ(client.request("GET /hello/you HTTP/1.1").status, 200);
}

TEST_F(HttpTest, EndsAConnectionWhenEvenTheRefusalFails) {
  Options options = quickOptions();
  options.log = [this](const std::string& line) {
    const std::lock_guard lock(logMutex_);
    logged_ += line + "\n";
  };
  options.problem = [](int, const std::string&) -> Response { throw std::runtime_error("no refusal"); };
  start(options);
  for (const RouteKind kind : {RouteKind::quick, RouteKind::takesLong, RouteKind::waiting})
    EXPECT_EQ(TestClient(port()).request("GET /throw/" + std::to_string(int(kind)) + " HTTP/1.1").status, 0);
  {
    const std::lock_guard lock(logMutex_);
    for (int kind = 0; kind < 3; ++kind)
      EXPECT_NE(logged_.find("GET /throw/" + std::to_string(kind) + ": the secret cause\n"),
                std::string::npos);
    EXPECT_NE(logged_.find("connection: no refusal\n"), std::string::npos);
  }
  EXPECT_EQ(TestClient(port()).request("GET /hello/you HTTP/1.1").status, 200);
  server_->stop(milliseconds(50));  // does not wait for them
}

TEST_F(HttpTest, GoesOnAcceptingAfterAFailure) {
  // The log has no memory for the first line that it gets: that there are no descriptors left.
  const auto lines = std::make_shared<std::atomic<int>>(0);
  Options options = quickOptions();
  options.log = [lines](const std::string&) {
    if ((*lines)++ == 0) throw std::bad_alloc();
  };
  start(options);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const int next = ::open("/dev/null", O_RDONLY);
  ASSERT_GE(next, 0);
  ::close(next);
  const rlimit less{rlim_t(next) + 1, before.rlim_max};  // one more, for the client
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &less), 0);
  TestClient client(port());
  const bool failed = eventually([&] { return *lines >= 2; });
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_TRUE(failed);
  EXPECT_EQ(client.request("GET /hello/you HTTP/1.1").status, 200);
}

TEST_F(HttpTest, DropsAHeaderThatWouldSplitTheAnswer) {
  start();
  TestClient client(port());
  const Answer answer = client.request("GET /split HTTP/1.1");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.headers.count("x-injected"), 0U);
}

TEST_F(HttpTest, LetsTheOwnerDecorateEveryAnswer) {
  Options options = quickOptions();
  options.decorate = [](Response& response) { response.headers.emplace_back("X-Frame-Options", "DENY"); };
  start(options);
  TestClient client(port());
  for (const char* path : {"/hello/you", "/none", "/throw"}) {
    EXPECT_EQ(client.request(std::string("GET ") + path + " HTTP/1.1").headers.at("x-frame-options"), "DENY")
        << path;
  }
}

TEST_F(HttpTest, AsksForAuthorisationBeforeReadingABody) {
  Options options = quickOptions();
  options.authorize = [](const Request& request) -> std::optional<Response> {
    if (request.queryValue("boom")) throw std::runtime_error("secret");
    if (request.header("Authorization")) return std::nullopt;
    return Response{401, "text/plain", "who?", {}};
  };
  start(options);
  TestClient client(port());
  EXPECT_EQ(client.request("GET /hello/you HTTP/1.1").status, 401);
  EXPECT_EQ(client.request("GET /hello/you HTTP/1.1\r\nAuthorization: x").status, 200);
  EXPECT_EQ(client.request("GET /hello/you?boom HTTP/1.1").status, 500);
  EXPECT_EQ(refusal(std::string(kPost) + "Content-Length: 900\r\n\r\n"), 401);
  EXPECT_EQ(echoes_, 0);
}

TEST_F(HttpTest, ReadsChunkedBodiesUpToTheLimit) {
  start();
  TestClient client(port());
  const std::string head = std::string(kPost) + "Transfer-Encoding: chunked\r\n\r\n";
  client.send(head + "3;ext=1\r\nabc\r\n2\r\nde\r\n0\r\nTrailer: x\r\n\r\n");
  EXPECT_EQ(client.answer().body, "POST abcde");
  client.send(head + "3e8\r\n" + std::string(1000, 'x') + "\r\n0\r\n\r\n");
  EXPECT_EQ(client.answer().body.size(), 1005U);
  EXPECT_EQ(refusal(head + "3e9\r\n" + std::string(1001, 'x') + "\r\n0\r\n\r\n"), 413);
  EXPECT_EQ(refusal(head + "200\r\n" + std::string(512, 'x') + "\r\n200\r\n" + std::string(512, 'x') +
                    "\r\n0\r\n\r\n"),
            413);
  EXPECT_EQ(refusal(head + "ffffffffffffffff\r\nx"), 413);
  EXPECT_EQ(refusal(head + "xyz\r\n"), 400);
  EXPECT_EQ(refusal(head + "3\r\nabcd\r\n0\r\n\r\n"), 400);
  EXPECT_EQ(echoes_, 2);
}

TEST_F(HttpTest, CountsTheBodiesThatItHoldsWhileTheyAreReceivedAndHandled) {
  Options options = quickOptions();
  Server server(options);
  std::atomic<std::size_t> whileHandled{0};
  server.route("POST", "/huge", [&](const Request&) {
    whileHandled = server.requestBodyBytes();
    return Response{200, "", std::string(64 << 20, 'x'), {}};
  });
  server.start();
  TestClient reader(server.port(), 4096);
  reader.send("POST /huge HTTP/1.1\r\nHost: a\r\nContent-Length: 900\r\n\r\n" + std::string(900, 'x'));
  EXPECT_EQ(reader.receiveSome(1), 1U);
  // Not while the answer waits to be read.
  EXPECT_EQ(server.requestBodyBytes(), 0U);
  EXPECT_EQ(whileHandled, 900U);
  {
    TestClient known(server.port()), unknown(server.port());
    known.send("POST /huge HTTP/1.1\r\nHost: a\r\nContent-Length: 900\r\n\r\nx");
    EXPECT_TRUE(eventually([&] { return server.requestBodyBytes() == 900; }));
    unknown.send("POST /huge HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n1\r\nx\r\n");
    EXPECT_TRUE(eventually([&] { return server.requestBodyBytes() == 1900; }));
  }
  EXPECT_TRUE(eventually([&] { return server.requestBodyBytes() == 0; }));
}

TEST_F(HttpTest, RefusesABodyOverTheLimitAndIsHeard) {
  start();
  TestClient client(port());
  const Answer answer = client.request("POST /echo HTTP/1.1", std::string(1000, 'x'));
  EXPECT_EQ(answer.status, 200);
  // The client sends the whole body before it reads the answer; a reset in between would lose the answer.
  TestClient large(port());
  EXPECT_EQ(large.request("POST /echo HTTP/1.1", std::string(8 << 20, 'x')).status, 413);
  EXPECT_TRUE(large.ended());
  EXPECT_EQ(refusal(std::string(kPost) + "Content-Length: 99999999999999999999999\r\n\r\n"), 400);
}

TEST_F(HttpTest, RefusesFramingThatTwoParsersCouldReadDifferently) {
  start();
  const std::string post = kPost;
  EXPECT_EQ(refusal(post + "Content-Length: 3\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"), 400);
  EXPECT_EQ(refusal(post + "Transfer-Encoding: chunked\r\nContent-Length: 3\r\n\r\n0\r\n\r\n"), 400);
  EXPECT_EQ(refusal(post + "Content-Length: 3\r\nContent-Length: 4\r\n\r\nabcd"), 400);
  EXPECT_EQ(refusal(post + "Content-Length: -1\r\n\r\n"), 400);
  EXPECT_EQ(refusal(post + "Content-Length: 3, 3\r\n\r\nabc"), 400);
  EXPECT_EQ(refusal(post + "Transfer-Encoding: gzip\r\n\r\n"), 501);
  EXPECT_EQ(refusal(post + "Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n"), 501);
  EXPECT_EQ(refusal(post + "Transfer-Encoding: gzip\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"), 501);
  EXPECT_EQ(refusal("POST /echo HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"), 400);
  EXPECT_EQ(refusal("GET /hello/you HTTP/1.1\r\n\r\n"), 400);
  EXPECT_EQ(refusal("GET /hello/you HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n"), 400);
  EXPECT_EQ(refusal("GET /hello/you HTTP/1.1\r\nHost : a\r\n\r\n"), 400);
  EXPECT_EQ(refusal("GET http://a/hello/you HTTP/1.1\r\nHost: a\r\n\r\n"), 400);
  EXPECT_EQ(refusal("GET /hello/%zz HTTP/1.1\r\nHost: a\r\n\r\n"), 400);
  EXPECT_EQ(refusal("GET /hello/you HTTP/2.0\r\nHost: a\r\n\r\n"), 505);
  EXPECT_EQ(refusal("\x16\x03\x01\x02\r\n\r\n"), 400);
  EXPECT_EQ(echoes_, 0);
}

TEST_F(HttpTest, RefusesEncodedBodies) {
  start();
  EXPECT_EQ(refusal(std::string(kPost) + "Content-Encoding: gzip\r\nContent-Length: 3\r\n\r\nabc"), 415);
  TestClient client(port());
  EXPECT_EQ(client.request("POST /echo HTTP/1.1\r\nContent-Encoding: identity", "abc").status, 200);
}

TEST_F(HttpTest, RefusesAHeadOverTheLimit) {
  start();
  EXPECT_EQ(refusal("GET /hello/you HTTP/1.1\r\nHost: a\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n"),
            431);
  std::string many = "GET /hello/you HTTP/1.1\r\nHost: a\r\n";
  while (many.size() < 1 << 20) many += "X-Filler: y\r\n";
  EXPECT_EQ(refusal(many), 431);
  EXPECT_EQ(refusal("GET /" + std::string(3'000, 'x') + " HTTP/1.1\r\nHost: a\r\n\r\n"), 414);
  EXPECT_EQ(refusal("GET /" + std::string(1 << 20, 'x')), 431);
  EXPECT_EQ(
      refusal(std::string(kPost) + "Transfer-Encoding: chunked\r\n\r\n0\r\nT: " + std::string(200'000, 'x')),
      431);
}

TEST_F(HttpTest, ContinuesOnlyRequestsThatItWillRead) {
  start();
  TestClient client(port());
  client.send(std::string(kPost) + "Expect: 100-continue\r\nContent-Length: 3\r\n\r\n");
  EXPECT_EQ(client.answer(true).status, 100);
  client.send("abc");
  EXPECT_EQ(client.answer().body, "POST abc");
  EXPECT_EQ(refusal(std::string(kPost) + "Expect: 100-continue\r\nContent-Length: 3000\r\n\r\n"), 413);
  EXPECT_EQ(refusal("POST /none HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 3\r\n\r\n"),
            404);
  EXPECT_EQ(refusal(std::string(kPost) + "Expect: miracles\r\nContent-Length: 3\r\n\r\n"), 417);
}

TEST_F(HttpTest, CutsSlowHeadsAndBodiesAndIdleConnections) {
  Options options = quickOptions();
  options.headTimeout = options.bodyTimeout = options.idleTimeout = milliseconds(100);
  start(options);
  EXPECT_EQ(refusal("GET /hello/you HT"), 408);
  EXPECT_EQ(refusal(std::string(kPost) + "Content-Length: 3\r\n\r\na"), 408);
  TestClient silent(port());
  EXPECT_TRUE(silent.ended());
  TestClient idle(port());
  EXPECT_EQ(idle.request("GET /hello/you HTTP/1.1").status, 200);
  EXPECT_TRUE(idle.ended());
}

TEST_F(HttpTest, CutsAHeadThatTricklesIn) {
  Options options = quickOptions();
  options.headTimeout = milliseconds(200);
  start(options);
  TestClient client(port());
  client.send("GET /hello/you HTTP/1.1\r\n");
  EXPECT_TRUE(eventually([&] { return !client.send("X"); }));
}

TEST_F(HttpTest, CutsAClientThatDoesNotReadItsAnswer) {
  Options options = quickOptions();
  options.bodyTimeout = milliseconds(100);
  start(options);
  TestClient client(port(), 4096);
  for (int i = 0; i < 20; ++i) client.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_TRUE(eventually([&] { return !client.send("X"); }));
}

TEST_F(HttpTest, CutsAClientThatReadsItsAnswerTooSlowly) {
  Options options = quickOptions();
  options.bodyTimeout = milliseconds(500);
  options.minAnswerRate = std::size_t(1) << 30;
  Server server(options);
  constexpr std::size_t kBytes = 64 << 20;
  server.route("GET", "/huge", [](const Request&) {
    return Response{200, "", std::string(kBytes, 'x'), {}};
  });
  server.start();
  TestClient client(server.port());
  client.send("GET /huge HTTP/1.1\r\nHost: a\r\n\r\n");
  // It never stalls, but takes five seconds.
  std::size_t received = 0;
  while (const std::size_t count = client.receiveSome(64 << 10)) {
    received += count;
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_LT(received, kBytes);
}

TEST_F(HttpTest, RefusesConnectionsOverTheLimitAndRecovers) {
  Options options = quickOptions();
  options.maxConnections = 3;
  start(options);
  {
    std::vector<std::unique_ptr<TestClient>> clients;
    for (int i = 0; i < 3; ++i) {
      clients.push_back(std::make_unique<TestClient>(port()));
      EXPECT_EQ(clients.back()->request("GET /hello/you HTTP/1.1").status, 200);
    }
    TestClient fourth(port());
    const Answer answer = fourth.request("GET /hello/you HTTP/1.1");
    EXPECT_EQ(answer.status, 503);
    EXPECT_EQ(answer.headers.at("retry-after"), "1");
    EXPECT_EQ(clients.front()->request("GET /hello/you HTTP/1.1").status, 200);
  }
  EXPECT_TRUE(
      eventually([&] { return TestClient(port()).request("GET /hello/you HTTP/1.1").status == 200; }));
}

class StrangersTest : public HttpTest {
 protected:
  /// A server with 8 connections, 4 of them for strangers, that waits for heads for ever.
  void SetUp() override {
    Options options = quickOptions();
    options.maxConnections = 8;
    options.headTimeout = options.idleTimeout = milliseconds(600'000);
    options.knows = [](const Request& request) { return request.header("X-Known") != nullptr; };
    start(options);
  }
  std::unique_ptr<TestClient> stranger(const char* from) {
    auto client = std::make_unique<TestClient>(port(), 0, from);
    client->send("GET /hello/you HTTP/1.1\r\nX-Kno");
    return client;
  }
  /// Waits until the server has accepted all connections so far, by opening another one with a known client.
  void allAccepted() {
    EXPECT_EQ(TestClient(port()).request("GET /hello/you HTTP/1.1\r\nX-Known: 1").status, 200);
  }
  /// Completes a stranger's head, after which the server knows it; false if it has been cut.
  static bool becomesKnown(TestClient& client) {
    return client.send("wn: 1\r\nHost: a\r\n\r\n") && client.answer().status == 200;
  }
};

TEST_F(StrangersTest, HaveHalfOfThePlacesAndAreCutToMakeRoom) {
  TestClient known(port());
  EXPECT_EQ(known.request("GET /hello/you HTTP/1.1\r\nX-Known: 1").status, 200);
  std::vector<std::unique_ptr<TestClient>> strangers, more;
  for (int i = 0; i < 20; ++i) strangers.push_back(stranger("127.0.0.1"));
  EXPECT_EQ(known.request("GET /hello/you HTTP/1.1\r\nX-Known: 1").status, 200);
  for (int i = 0; i < 7; ++i) {
    more.push_back(std::make_unique<TestClient>(port()));
    EXPECT_EQ(more.back()->request("GET /hello/you HTTP/1.1\r\nX-Known: 1").status, 200);
  }
  EXPECT_EQ(TestClient(port()).request("GET /hello/you HTTP/1.1\r\nX-Known: 1").status, 503);
  for (const auto& one : strangers) EXPECT_TRUE(one->ended());
}

TEST_F(StrangersTest, OfTheAddressThatHasTheMostAreCut) {
  const auto honest = stranger("127.0.0.2");
  std::vector<std::unique_ptr<TestClient>> flood;
  for (int i = 0; i < 100; ++i) flood.push_back(stranger("127.0.0.1"));
  allAccepted();
  EXPECT_TRUE(becomesKnown(*honest));
}

TEST_F(StrangersTest, OfOneAddressAreCutInNoOrderThatAFloodCouldUse) {
  int survived = 0;
  std::vector<std::unique_ptr<TestClient>> flood;
  for (int i = 0; i < 4; ++i) flood.push_back(stranger("127.0.0.1"));
  // While an honest client completes its head, nine others connect. It survives with probability 0.75^9 =
  // 0.075; if the oldest were cut, never. That none of 300 does has a probability of 7e-11.
  for (int i = 0; i < 300 && survived == 0; ++i) {
    const auto honest = stranger("127.0.0.1");
    for (int j = 0; j < 8; ++j) flood.push_back(stranger("127.0.0.1"));
    allAccepted();
    if (becomesKnown(*honest)) ++survived;
  }
  EXPECT_EQ(survived, 1);
}

TEST_F(HttpTest, SurvivesClientsThatComeAndGoAbruptly) {
  start();
  for (int i = 0; i < 200; ++i) {
    TestClient client(port());
    if (i % 4 == 1) client.send("GET /hello/y");
    if (i % 4 == 2) client.send(std::string(kPost) + "Content-Length: 900\r\n\r\nabc");
    if (i % 4 == 3) client.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
    if (i % 2 == 0) client.reset();
  }
  EXPECT_EQ(TestClient(port()).request("GET /hello/you HTTP/1.1").status, 200);
}

TEST_F(HttpTest, NeverLetsTwoServersShareAPort) {
  start();
  Options options = quickOptions();
  options.port = port();
  Server second(options);
  try {
    second.start();
    FAIL() << "the port is taken";
  } catch (const NetError& error) {
    EXPECT_NE(std::string(error.what()).find("127.0.0.1:" + std::to_string(port())), std::string::npos);
  }
}

TEST_F(HttpTest, NamesAHostThatItCannotBind) {
  Options options = quickOptions();
  options.host = "no such host";
  Server server(options);
  EXPECT_THROW(server.start(), NetError);
}

TEST_F(HttpTest, StopCutsClientsThatStall) {
  start();
  TestClient halfHead(port());
  halfHead.send("GET /hel");
  TestClient halfBody(port());
  halfBody.send(std::string(kPost) + "Content-Length: 900\r\n\r\nabc");
  TestClient noReader(port(), 4096);
  for (int i = 0; i < 4; ++i) noReader.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_EQ(TestClient(port()).request("GET /hello/you HTTP/1.1").status, 200);
  server_->stop(milliseconds(50));
  server_->stop(milliseconds(50));
  EXPECT_TRUE(halfHead.ended());
}

}  // namespace
}  // namespace scolopax::net
