// SPDX-License-Identifier: Apache-2.0
#include "server/api.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/problem.h"
#include "tests/server/fake_api.h"
#include "tests/server/net/gate.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using protocol::ProtocolError;
using testing::Api;
using testing::FakeViewer;

using Expected = std::pair<int, std::string>;

std::string headerOf(const net::Response& response, std::string_view name) {
  for (const auto& [key, value] : response.headers)
    if (key == name) return value;
  return "absent";
}

TEST(Api, ListsAndDescribesDatasets) {
  Api api;
  const json list = json::parse(api.call("GET", "/api/v1/datasets").body);
  ASSERT_EQ(list["datasets"].size(), 2u);
  EXPECT_EQ(json::parse(api.call("GET", "/api/v1/datasets/other").body), list["datasets"][1]);
  EXPECT_EQ(api.errorOf("GET", "/api/v1/datasets/none").first, 404);
  EXPECT_EQ(json::parse(api.call("GET", "/api/v1/datasets/small/histogram?channel=1").body)["maximum"],
            230.0);
  EXPECT_EQ(api.errorOf("GET", "/api/v1/datasets/small/histogram?channel=2").first, 422);
  EXPECT_EQ(api.errorOf("GET", "/api/v1/datasets/small/histogram?channel=x").first, 422);
  EXPECT_EQ(json::parse(api.call("GET", "/api/v1/datasets/small/probe?x=1&y=0&z=0").body)["values"][0], 1.0);
  EXPECT_EQ(api.errorOf("GET", "/api/v1/datasets/small/probe?x=1&y=0").first, 422);
  EXPECT_EQ(api.errorOf("GET", "/api/v1/datasets/small/probe?x=nan&y=0&z=0").first, 422);
}

TEST(Api, MakesOneFlowOfASessionAndOneOfAllElse) {
  Api api;
  const std::string id = api.workshop.store.create(json::object())->id();
  const auto flow = [&](const std::string& path) {
    net::Request request;
    request.path = path;
    return flowOf(api.workshop.store, request);
  };
  for (const char* path : {"", "/scene", "/frame", "/stream"})
    EXPECT_EQ(flow("/api/v1/sessions/" + id + path), id);
  for (const std::string& path :
       {std::string("/"), std::string("/api/v1/sessions"), "/api/v1/sessions/no" + id,
        "/api/v1/datasets/" + id, std::string("/api/v1/sessions//scene")})
    EXPECT_EQ(flow(path), "");
}

constexpr const char* kSmallRender = R"({"image": {"width": 20, "height": 10}, "stop": {"samples": 3}})";

TEST(Api, RendersToTheTypeThatIsAskedFor) {
  Api api;
  const auto jpeg = api.call("POST", "/api/v1/render", kSmallRender);
  EXPECT_EQ(jpeg.status, 200);
  EXPECT_EQ(jpeg.contentType, "image/jpeg");
  EXPECT_EQ(headerOf(jpeg, "Scolopax-Samples"), "3");
  EXPECT_EQ(jpeg.body.substr(0, 2), "\xFF\xD8");
  const net::Headers png{{"Content-Type", "application/json"}, {"Accept", "image/png"}};
  EXPECT_EQ(api.call("POST", "/api/v1/render", kSmallRender, png).body.substr(1, 3), "PNG");
  const net::Headers text{{"Content-Type", "application/json"}, {"Accept", "text/html"}};
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", kSmallRender, text).first, 406);
}

TEST(Api, GivesTheSameBytesForTheSameRender) {
  Api api;
  const auto first = api.call("POST", "/api/v1/render", kSmallRender);
  const auto second = api.call("POST", "/api/v1/render", kSmallRender);
  EXPECT_EQ(first.body, second.body);
  EXPECT_EQ(headerOf(first, "Scolopax-Scene"), headerOf(second, "Scolopax-Scene"));
  const auto other = api.call("POST", "/api/v1/render",
                              R"({"image": {"width": 20, "height": 10}, "integrator": {"seed": 1}})");
  EXPECT_NE(headerOf(first, "Scolopax-Scene"), headerOf(other, "Scolopax-Scene"));
}

TEST(Api, EndsARenderAtATimeThatIsAlsoTheServersLimit) {
  Api api;
  api.config.maxRenderSeconds = 0.2;
  int passes = 0;
  api.workshop.control->duringPass = [&] {
    if (++passes > 1) std::this_thread::sleep_for(300ms);
  };
  const auto response =
      api.call("POST", "/api/v1/render", R"({"image": {"width": 9, "height": 9}, "stop": {"seconds": 0.2}})");
  EXPECT_EQ(response.status, 200);
  EXPECT_NE(headerOf(response, "Scolopax-Samples"), "0");
}

TEST(Api, EndsTheMeasuringOfAnErrorWithTheTimeForTheRender) {
  Api api;
  api.config.maxRenderSeconds = 0.5;
  api.workshop.control->longErrorFrom = 3;
  api.workshop.control->measuring = [](const std::stop_token& stop) {
    while (!stop.stop_requested()) std::this_thread::sleep_for(1ms);
  };
  const auto finished = api.call("POST", "/api/v1/render", kSmallRender);
  EXPECT_EQ(finished.status, 200);
  EXPECT_EQ(headerOf(finished, "Scolopax-Error"), "null");
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render",
                        R"({"image": {"width": 20, "height": 10}, "stop": {"error": 2}})"),
            Expected(422, "/stop"));
}

TEST(Api, EndsTheMeasuringOfAnErrorWhenItsClientHasGoneOrTheServerStops) {
  for (const bool gone : {false, true}) {
    Api api;
    api.workshop.control->longErrorFrom = 3;
    bool stopped = false;
    api.workshop.control->measuring = [&](const std::stop_token& stop) {
      (gone ? api.gone : api.abortRequests).request_stop();
      stopped = stop.stop_requested();
    };
    EXPECT_EQ(api.errorOf("POST", "/api/v1/render", kSmallRender), Expected(503, ""));
    EXPECT_TRUE(stopped);
  }
}

TEST(Api, MeasuresAnErrorThatARenderEndsAt) {
  Api api;
  api.workshop.control->longErrorFrom = 16;
  const auto response =
      api.call("POST", "/api/v1/render", R"({"image": {"width": 20, "height": 10}, "stop": {"error": 2}})");
  EXPECT_EQ(headerOf(response, "Scolopax-Samples"), "16");
  EXPECT_EQ(headerOf(response, "Scolopax-Error"), "1.0");
}

TEST(Api, HoldsARenderToTheLimits) {
  Api api;
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", R"({"image": {"width": 50, "height": 21}})"),
            Expected(422, "/image"));
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render",
                        R"({"stop": {"seconds": 61}, "image": {"width": 9, "height": 9}})"),
            Expected(422, "/stop/seconds"));
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", R"({"channels": [{}, {"density": "thick"}]})"),
            Expected(422, "/channels/1/density"));
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", "{"), Expected(400, ""));
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", "{}", {{"Content-Type", "text/plain"}}).first, 415);
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", "{}", {}).first, 415);
  api.config.maxBodyBytes = 10;
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", kSmallRender).first, 413);
}

TEST(Api, RepeatsNoMoreThan200BytesOfWhatItWasSent) {
  Api api;
  const std::string text(900, 'x');
  const std::string session = "/api/v1/sessions/" + api.workshop.store.create(json::object())->id();
  const json dataset{{"dataset", text}}, unknown{{text, 1}}, method{{"integrator", {{"method", text}}}};
  struct Call {
    std::string method, target, body;
    net::Headers headers{{"Content-Type", "application/json"}};
  };
  const Call calls[] = {
      {"GET", "/api/v1/datasets/" + text, ""},
      {"GET", "/api/v1/sessions/" + text, ""},
      {"GET", session + "/frame?aov=" + text, ""},
      {"GET", session + "/frame?format=" + text, ""},
      {"GET", session + "/frame?after=" + text, ""},
      {"GET", session + "/frame?timeout=" + text, ""},
      {"POST", "/api/v1/sessions", unknown.dump()},
      {"POST", "/api/v1/sessions", json{{"scene", unknown}}.dump()},
      {"POST", "/api/v1/sessions", json{{"scene", dataset}}.dump()},
      {"POST", "/api/v1/sessions", json{{"scene", method}}.dump()},
      {"POST", "/api/v1/sessions", "{}", {{"Content-Type", text}}},
      {"POST", "/api/v1/render", "{}", {{"Content-Type", "application/json"}, {"Accept", text}}},
      {"PUT", session + "/scene", "{}", {{"Content-Type", "application/json"}, {"If-Match", text}}}};
  for (const Call& call : calls) {
    try {
      api.call(call.method, call.target, call.body, call.headers);
      ADD_FAILURE() << "no error: " << call.method << ' ' << call.target;
    } catch (const ProtocolError& error) {
      const auto echoed = [](std::string_view detail) {
        return std::count(detail.begin(), detail.end(), 'x');
      };
      EXPECT_LE(echoed(error.what()), 205) << error.what();
      EXPECT_LE(echoed(error.pointer), 205) << error.pointer;
    }
  }
}

TEST(Api, RefusesOneRenderTooManyWith503) {
  Api api;
  int nested = 0;
  api.workshop.control->duringPass = [&] {
    if (nested == 0) nested = api.errorOf("POST", "/api/v1/render", kSmallRender).first;
  };
  EXPECT_EQ(api.call("POST", "/api/v1/render", kSmallRender).status, 200);
  EXPECT_EQ(nested, 503);
  EXPECT_EQ(api.call("POST", "/api/v1/render", kSmallRender).status, 200);  // the slot is free again
  EXPECT_EQ(headerOf(errorResponse(ProtocolError(503, "", "busy")), "Retry-After"), "1");
}

TEST(Api, KeepsTheNextRenderForAnotherClientThatWasRefused) {
  Api api;
  const auto renderOf = [&](const char* client) {
    api.client = client;
    return api.errorOf("POST", "/api/v1/render", kSmallRender).first;
  };
  int nested = 0;
  api.workshop.control->duringPass = [&] {
    if (nested == 0) nested = renderOf("192.0.2.2");
  };
  EXPECT_EQ(renderOf("192.0.2.1"), 200);
  EXPECT_EQ(nested, 503);
  EXPECT_EQ(renderOf("192.0.2.1"), 503);
  EXPECT_EQ(renderOf("192.0.2.2"), 200);
  EXPECT_EQ(renderOf("192.0.2.1"), 200);
}

TEST(Api, KeepsNoPlaceForARenderThatWaitsToBeEncodedNorForOneWhoseClientHasGone) {
  Api api;
  net::Gate gate;
  // Takes the only slot that such pictures have at the encoders.
  api.encoders.start(
      "", [&](const std::stop_token&) { gate.pass(); }, [] {});
  gate.waitFor(1);
  std::atomic<int> samples{0};
  api.workshop.control->duringPass = [&] { ++samples; };
  {
    const auto render = [&] {
      // Refused until the slot of the previous one is free.
      while (!api.gone.stop_requested())
        EXPECT_EQ(api.errorOf("POST", "/api/v1/render", kSmallRender), Expected(503, ""));
    };
    const std::jthread first(render);
    EXPECT_TRUE(net::eventually([&] { return samples == 3; }));
    const std::jthread second(render);
    EXPECT_TRUE(net::eventually([&] { return samples == 6; }));
    api.gone.request_stop();
  }
  EXPECT_EQ(gate.arrived(), 1);  // the gate was not opened
}

TEST(Api, EndsARenderWhenTheServerStops) {
  Api api;
  api.workshop.control->duringPass = [&] { api.stopping = true, api.abortRequests.request_stop(); };
  EXPECT_EQ(api.errorOf("POST", "/api/v1/render", kSmallRender).first, 503);
  EXPECT_EQ(api.errorOf("GET", "/readyz").first, 503);
  EXPECT_EQ(api.call("GET", "/healthz").status, 200);
}

TEST(Api, NamesALimitInFewDigits) {
  Api api;
  try {
    api.call("POST", "/api/v1/render", R"({"stop": {"seconds": 1e300}, "image": {"width": 9, "height": 9}})");
    FAIL() << "was not refused";
  } catch (const ProtocolError& error) {
    EXPECT_STREQ(error.what(), "expected at most 60, found 1e+300");
  }
}

TEST(Api, EditsASessionsScene) {
  Api api;
  const auto created = api.call("POST", "/api/v1/sessions", R"({"scene": {"integrator": {"seed": 3}}})");
  EXPECT_EQ(created.status, 201);
  const json session = json::parse(created.body);
  const std::string path = "/api/v1/sessions/" + session["id"].get<std::string>();
  EXPECT_EQ(headerOf(created, "Location"), path);
  EXPECT_EQ(session["revision"], 1);
  EXPECT_EQ(session["scene"]["integrator"]["seed"], 3);

  const json patched = json::parse(api.call("PATCH", path + "/scene", R"({"integrator": {"seed": 4}})",
                                            {{"Content-Type", "application/merge-patch+json"}})
                                       .body);
  EXPECT_EQ(patched["revision"], 2);
  EXPECT_EQ(patched["scene"]["integrator"]["seed"], 4);
  EXPECT_EQ(api.errorOf("PATCH", path + "/scene", R"({"integrator": {"sede": 4}})"),
            Expected(422, "/integrator/sede"));
  EXPECT_EQ(api.errorOf("PATCH", path + "/scene", "{}",
                        {{"Content-Type", "application/json"}, {"If-Match", "\"1\""}}),
            Expected(409, ""));
  EXPECT_EQ(
      api.errorOf("PATCH", path + "/scene", "{}", {{"Content-Type", "application/json"}, {"If-Match", "x"}})
          .first,
      400);
  const json put = json::parse(
      api.call("PUT", path + "/scene", "{}", {{"Content-Type", "application/json"}, {"If-Match", "\"2\""}})
          .body);
  EXPECT_EQ(put["revision"], 3);
  EXPECT_EQ(put["scene"]["integrator"]["seed"], 0);
  EXPECT_EQ(json::parse(api.call("GET", path + "/scene").body), put);
  EXPECT_EQ(json::parse(api.call("GET", path).body)["revision"], 3);
  EXPECT_EQ(api.call("DELETE", path).status, 204);
  EXPECT_EQ(api.errorOf("GET", path).first, 404);
  EXPECT_EQ(api.errorOf("DELETE", path).first, 404);
}

TEST(Api, AnswersEditsWithoutTheSceneOnceTheAnswersThatNobodyReadsTakeTheirShareOfTheMemory) {
  Api api(std::make_shared<MemoryBudget>(std::uint64_t(64) << 20));
  json points = json::array();
  for (int i = 0; i < 4096; ++i) points.push_back({i / 4096.0, 0.123456789});
  const json scene{{"channels", {{{"opacity", points}}, {{"opacity", points}}}}};
  std::vector<net::Response> unread;
  unread.push_back(api.call("POST", "/api/v1/sessions", json{{"scene", scene}}.dump()));
  const std::string path = "/api/v1/sessions/" + json::parse(unread.back().body)["id"].get<std::string>();
  EXPECT_GT(unread.back().body.size(), 100'000u);
  int whole = 0;
  for (std::uint32_t revision = 2; revision < 200; ++revision) {
    unread.push_back(api.call("PATCH", path + "/scene", "{}"));
    ASSERT_EQ(unread.back().status, 200);
    EXPECT_EQ(headerOf(unread.back(), "ETag"), '"' + std::to_string(revision) + '"');
    const json answer = json::parse(unread.back().body);
    EXPECT_EQ(answer["revision"], revision);
    whole += answer.contains("scene");
  }
  EXPECT_GT(whole, 30);
  EXPECT_LT(whole, 198);
  EXPECT_LE(api.memory->used(MemoryUse::answers), api.memory->limit() / 8);
  // A session has begun, too, although there is no memory for its scene.
  const json begun = json::parse(api.call("POST", "/api/v1/sessions", json{{"scene", scene}}.dump()).body);
  EXPECT_EQ(begun.contains("scene"), false);
  EXPECT_NE(api.workshop.store.find(begun["id"].get<std::string>()), nullptr);
  unread.clear();
  EXPECT_EQ(api.memory->used(MemoryUse::answers), 0u);
}

TEST(Api, BeginsASessionWithoutABody) {
  Api api;
  EXPECT_EQ(api.call("POST", "/api/v1/sessions", "", {}).status, 201);
  EXPECT_EQ(api.call("POST", "/api/v1/sessions", "{}").status, 201);
  EXPECT_EQ(api.errorOf("POST", "/api/v1/sessions", R"({"secne": {}})"), Expected(422, "/secne"));
  EXPECT_EQ(api.errorOf("POST", "/api/v1/sessions", "[]").first, 422);
}

TEST(Api, AnswersTheLongPollWithAFrameOrWithNothing) {
  Api api;
  const auto session = api.workshop.store.create({{"stop", {{"samples", 2}}}});
  const std::string path = "/api/v1/sessions/" + session->id() + "/frame";
  EXPECT_EQ(api.call("GET", path).status, 204);
  session->addViewer(std::make_shared<FakeViewer>());
  api.workshop.steps(4);
  const auto frame = api.call("GET", path + "?minSamples=2");
  EXPECT_EQ(frame.contentType, "image/jpeg");
  EXPECT_EQ(headerOf(frame, "Scolopax-Samples"), "2");
  EXPECT_EQ(headerOf(frame, "Scolopax-Final"), "1");
  EXPECT_EQ(api.call("GET", path + "?format=png").body.substr(1, 3), "PNG");
  EXPECT_EQ(api.call("GET", path + "?format=exr").body.substr(0, 4), "\x76\x2f\x31\x01");
  EXPECT_EQ(api.call("GET", path + "?after=" + headerOf(frame, "Scolopax-Frame")).status, 204);
  EXPECT_EQ(api.errorOf("GET", path + "?format=gif").first, 422);
}

TEST(Api, EncodesNoPictureForAClientThatHasGone) {
  Api api;
  const auto session = api.workshop.store.create({{"stop", {{"samples", 2}}}});
  session->addViewer(std::make_shared<FakeViewer>());
  api.workshop.steps(4);
  const std::string path = "/api/v1/sessions/" + session->id() + "/frame?format=";
  EXPECT_EQ(api.call("GET", path + "exr").status, 200);
  EXPECT_EQ(api.call("GET", path + "png&aov=depth").status, 204);
  api.workshop.steps(6);
  EXPECT_EQ(api.call("GET", path + "png&aov=depth").status, 200);
  api.gone.request_stop();
  for (const char* format : {"png", "exr", "png&aov=depth"})
    EXPECT_EQ(api.errorOf("GET", path + format), Expected(503, "")) << format;
}

TEST(Api, RefusesOneWaitingScriptTooManyWith429) {
  Api api;
  api.config.pollTimeout = 60s;
  const auto session = api.workshop.store.create(json::object());
  std::vector<std::thread> waiting;
  for (std::size_t i = 0; i < Session::kMaxPolls; ++i)
    waiting.emplace_back([&] { session->waitForFrame({}, 60s); });
  // The render request lists the waiting scripts.
  while (session->request().pollSamples.size() < Session::kMaxPolls) std::this_thread::yield();
  EXPECT_EQ(api.errorOf("GET", "/api/v1/sessions/" + session->id() + "/frame").first, 429);
  session->close("enough");
  for (auto& thread : waiting) thread.join();
}

TEST(Api, RefusesAPickThatIsNone) {
  Api api;
  const auto session = api.workshop.store.create({{"image", {{"width", 64}, {"height", 48}}}});
  const std::string path = "/api/v1/sessions/" + session->id() + "/pick";
  EXPECT_EQ(api.errorOf("GET", "/api/v1/sessions/none/pick?x=1&y=1").first, 404);
  for (const char* query : {"", "?x=1", "?x=1&y=b", "?x=nan&y=1", "?x=1&y=1&x2=&y2=2"})
    EXPECT_EQ(api.errorOf("GET", path + query).first, 422) << query;
  EXPECT_EQ(api.errorOf("GET", path + "?x=64&y=1"), Expected(422, "/x"));
  EXPECT_EQ(api.errorOf("GET", path + "?x=1&y=-1"), Expected(422, "/y"));
  EXPECT_EQ(api.errorOf("GET", path + "?x=1&y=1&x2=2&y2=48"), Expected(422, "/y2"));
  EXPECT_EQ(api.errorOf("GET", path + "?x=1&y=1&x2=2"), Expected(422, "/y2"));
  EXPECT_EQ(api.errorOf("GET", path + "?x=1&y=1").first, 503);  // nothing renders it, and the timeout is 0
}

TEST(Api, DescribesEveryRouteInOpenApi) {
  Api api;
  const json description = openApi(api.routes);
  std::size_t operations = 0;
  for (const json& path : description["paths"]) operations += path.size();
  EXPECT_EQ(operations, api.routes.size());
  const json& histogram = description["paths"]["/api/v1/datasets/{id}/histogram"]["get"];
  ASSERT_EQ(histogram["parameters"].size(), 2u);
  EXPECT_EQ(histogram["parameters"][0]["required"], true);
  EXPECT_EQ(histogram["parameters"][1]["name"], "channel");
  EXPECT_TRUE(description["paths"]["/api/v1/render"]["post"].contains("requestBody"));
}

TEST(Api, DescribesParametersByTheListsAndSettingsThatItUses) {
  Api api;
  const json description = openApi(api.routes);
  std::string docs;
  for (const json& one : description["paths"]["/api/v1/sessions/{id}/frame"]["get"]["parameters"])
    docs += one["name"].get<std::string>() + ": " + one["description"].get<std::string>() + '\n';
  EXPECT_NE(docs.find("aov: What to return instead of colours, one of depth, transmittance, channel, cost\n"),
            std::string::npos)
      << docs;
  EXPECT_NE(docs.find("timeout: Seconds to wait, at most 0, "), std::string::npos) << docs;
}

TEST(Api, CountsInTheMetrics) {
  Api api;
  api.workshop.store.create(json::object());
  api.metrics.requestAnswered(200);
  api.metrics.requestAnswered(404);
  api.metrics.requestAnswered(404);
  PassResult pass;
  pass.rendered = true;
  pass.pixels = 100;
  pass.renderSeconds = 0.5;
  api.metrics.passEnded(pass);
  for (const bool built : {true, false, false}) {
    PassResult taken;
    taken.built = built;
    taken.abandoned = !built;
    api.metrics.passEnded(taken);
  }
  const std::string text = api.call("GET", "/metrics").body;
  for (const char* line :
       {"scolopax_http_requests_total{status=\"404\"} 2", "scolopax_sessions 1", "scolopax_samples_total 100",
        "scolopax_render_seconds_total 0.5", "scolopax_clients 0", "scolopax_unread_text_bytes 123",
        "scolopax_request_body_bytes 456", "scolopax_builds_total 1", "scolopax_builds_abandoned_total 2"})
    EXPECT_NE(text.find(line), std::string::npos) << line << " in\n" << text;
}

}  // namespace
}  // namespace scolopax::server
