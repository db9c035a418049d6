// SPDX-License-Identifier: Apache-2.0
// Over HTTP: the histogram of gradients, and scenes that need it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/server/fake_api.h"

namespace scolopax::server {
namespace {

using nlohmann::json;
using testing::Api;
using Expected = std::pair<int, std::string>;

TEST(Api, MeasuresGradientsWhenTheyAreFirstAskedForWhereItMayWait) {
  Api api;
  const std::string path = "/api/v1/datasets/small/gradient-histogram";
  EXPECT_EQ(api.errorOf("GET", path + "?channel=2"), Expected(422, "/channel"));
  EXPECT_EQ(api.errorOf("GET", path + "?channel=-1").first, 422);
  EXPECT_EQ(api.errorOf("GET", path + "?joint=1").first, 422);
  EXPECT_EQ(api.errorOf("GET", "/api/v1/datasets/none/gradient-histogram").first, 404);
  EXPECT_EQ(api.tookLong, 0);
  const json told = json::parse(api.call("GET", path + "?channel=1").body);
  EXPECT_EQ(api.tookLong, 1);
  EXPECT_EQ(told["channel"], 1);
  EXPECT_EQ(told["name"], "green");
  EXPECT_EQ(told["nonFiniteCount"], 0);
  // Values rise by 10, 40 and 120 along the axes.
  EXPECT_NEAR(told["maximum"], std::sqrt(100.0 + 1600 + 14400), 1e-9);
  std::vector<std::uint64_t> bins(256);
  bins.back() = 24;
  EXPECT_EQ(told["bins"], json(bins));
  EXPECT_FALSE(told.contains("joint"));
  const json joint = json::parse(api.call("GET", path + "?channel=1&joint=true").body)["joint"];
  EXPECT_EQ(api.tookLong, 1);
  ASSERT_EQ(joint.size(), 256u);
  const json values = json::parse(api.call("GET", "/api/v1/datasets/small/histogram?channel=1").body)["bins"];
  for (std::size_t i = 0; i < joint.size(); ++i) EXPECT_EQ(joint[i][255], values[i]) << i;
}

constexpr const char* kSteepRender = R"({"channels": {"0": {"gradientOpacity": {}}},
  "image": {"width": 20, "height": 10}, "stop": {"samples": 3}})";

TEST(Api, EndsTheMeasuringOfGradientsWhenItsClientHasGoneOrTheServerStops) {
  for (const bool gone : {false, true}) {
    Api api;
    (gone ? api.gone : api.abortRequests).request_stop();
    EXPECT_EQ(api.errorOf("GET", "/api/v1/datasets/small/gradient-histogram"), Expected(503, ""));
    EXPECT_EQ(api.errorOf("POST", "/api/v1/sessions", json{{"scene", testing::gradientPatch()}}.dump()),
              Expected(503, ""));
    EXPECT_EQ(api.errorOf("POST", "/api/v1/render", kSteepRender), Expected(503, ""));
    EXPECT_EQ(api.tookLong, 2);
  }
}

TEST(Api, MakesEditsWaitForWhatTheyNeedMeasured) {
  const std::string steep = testing::gradientPatch().dump();
  const auto rangeOf = [](const net::Response& response) {
    return json::parse(response.body)["scene"]["channels"][0]["gradientOpacity"]["range"];
  };
  json range;
  for (const char* method : {"PATCH", "PUT"}) {
    Api api;
    const json session = json::parse(api.call("POST", "/api/v1/sessions", "{}").body);
    const std::string path = "/api/v1/sessions/" + session["id"].get<std::string>() + "/scene";
    const auto edited = api.call(method, path, steep);
    EXPECT_EQ(api.tookLong, 1);
    EXPECT_EQ(json::parse(edited.body)["revision"], 2);
    range = rangeOf(edited);
    EXPECT_EQ(range.size(), 2u);
    api.call("PATCH", path, R"({"channels": {"0": {"gradientOpacity": {"range": null}}}})");
    EXPECT_EQ(rangeOf(api.call("POST", "/api/v1/sessions", json{{"scene", json::parse(steep)}}.dump())),
              range);
    EXPECT_EQ(api.tookLong, 1) << "it is known from then on";
  }
  Api api;
  EXPECT_EQ(rangeOf(api.call("POST", "/api/v1/sessions", json{{"scene", json::parse(steep)}}.dump())), range);
  EXPECT_EQ(api.tookLong, 1);
  EXPECT_EQ(api.call("POST", "/api/v1/render", kSteepRender).status, 200);
}

}  // namespace
}  // namespace scolopax::server
