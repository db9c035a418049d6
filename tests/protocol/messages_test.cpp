// SPDX-License-Identifier: Apache-2.0
#include "protocol/messages.h"

#include <gtest/gtest.h>

#include "tests/protocol/fixtures.h"

namespace scolopax::protocol {
namespace {

using nlohmann::json;

/// The server's message with this name in the fixtures.
json serverFixture(const std::string& name) {
  const json fixtures = readFixture("messages.json");
  for (const json& fixture : fixtures["server"]) {
    if (fixture["name"] == name) return fixture["message"];
  }
  ADD_FAILURE() << "no fixture " << name;
  return {};
}

TEST(ParseClientMessage, TakesAndRefusesTheFixtures) {
  const json fixtures = readFixture("messages.json");
  EXPECT_GT(fixtures["client"].size(), 20U);
  for (const json& fixture : fixtures["client"]) {
    SCOPED_TRACE(fixture["name"].get<std::string>());
    std::string refusedAt = "none";
    try {
      parseClientMessage(fixture["message"].dump());
    } catch (const ProtocolError& error) {
      EXPECT_EQ(error.status, 422);
      refusedAt = error.pointer;
    }
    EXPECT_EQ(refusedAt, fixture.value("refusedAt", "none"));
  }
}

TEST(ParseClientMessage, ReadsEveryField) {
  const auto patch =
      std::get<PatchMessage>(parseClientMessage(R"({"type": "patch", "id": 7, "patch": {"a": 1}})"));
  EXPECT_EQ(patch.id, 7U);
  EXPECT_EQ(patch.patch, json::parse(R"({"a": 1})"));
  EXPECT_EQ(std::get<AckMessage>(parseClientMessage(R"({"type": "ack", "frame": 12})")).frame, 12U);
  EXPECT_EQ(std::get<PingMessage>(parseClientMessage(R"({"type": "ping", "id": 3})")).id, 3U);
  EXPECT_EQ(std::get<ResumeMessage>(parseClientMessage(R"({"type": "resume", "token": "abc"})")).token,
            "abc");
  const auto view = std::get<ViewMessage>(parseClientMessage(
      R"({"type": "view", "visible": false, "maxWidth": 640, "maxHeight": 480, "maxFps": 7.5})"));
  EXPECT_FALSE(view.visible);
  EXPECT_EQ(view.maxWidth, 640U);
  EXPECT_EQ(view.maxHeight, 480U);
  EXPECT_EQ(view.maxFps, 7.5);
  const auto pick = std::get<PickMessage>(
      parseClientMessage(R"({"type": "pick", "id": 9, "x": 4.5, "y": 3, "x2": 8, "y2": 0})"));
  EXPECT_EQ(pick.id, 9U);
  EXPECT_EQ(std::tuple(pick.x, pick.y, pick.x2, pick.y2), std::tuple(4.5, 3.0, 8.0, 0.0));
  EXPECT_EQ(std::get<PickMessage>(parseClientMessage(R"({"type": "pick", "id": 1, "x": 4, "y": 3})")).x2,
            std::nullopt);
  EXPECT_TRUE(std::get<ViewMessage>(parseClientMessage(R"({"type": "view"})")).visible);
}

TEST(ParseClientMessage, RefusesWhatIsNotJsonOrTooLarge) {
  const auto statusOf = [](const std::string& text, const Limits& limits) {
    try {
      parseClientMessage(text, limits);
    } catch (const ProtocolError& error) {
      return error.status;
    }
    return 0;
  };
  EXPECT_EQ(statusOf("{", {}), 400);
  EXPECT_EQ(statusOf(R"({"type": "ping"})", {.bytes = 10}), 413);
  EXPECT_EQ(statusOf(R"({"type": "patch", "id": 1, "patch": {"a": [[]]}})", {.depth = 3}), 400);
}

TEST(ServerMessages, AreWrittenAsTheFixtures) {
  EXPECT_EQ(json::parse(helloText({{"version", "0.1.0"}}, "k3", "3q2-7w")), serverFixture("hello"));
  EXPECT_EQ(json::parse(sceneText(8, R"({"channels": {"1": {"color": "#ff0000"}}})")),
            serverFixture("scene"));
  EXPECT_EQ(
      json::parse(errorText(
          ProtocolError(422, "/camera/fovY", "/camera/fovY: expected a number > 0 and < 180, found 200"), 7)),
      serverFixture("error of a patch"));
  EXPECT_EQ(json::parse(errorText(ProtocolError(400, "", "not valid JSON at byte 1"))),
            serverFixture("error of something else"));
  EXPECT_EQ(json::parse(noticeText("The server is stopping.")), serverFixture("notice"));
  EXPECT_EQ(json::parse(pongText(3)), serverFixture("pong"));
  const json hit = json::parse(R"({"revision": 8, "hit": true, "point": [10.5, -3.25, 0],
    "voxel": [139, 124, 63], "channel": 0, "name": "T1", "depth": 214.5, "values": [411.25]})");
  EXPECT_EQ(json::parse(pickedText(3, hit)), serverFixture("picked"));
  EXPECT_EQ(json::parse(pickedText(4, json{{"revision", 8}, {"truncated", false}, {"hits", json::array()}})),
            serverFixture("picked in a rectangle"));
  EXPECT_EQ(
      json::parse(pickedText(5, ProtocolError(422, "/x", "/x: expected a number >= 0 and < 800, found 900"))),
      serverFixture("picked in vain"));
}

TEST(ServerMessages, AreUtf8WhateverTheyTell) {
  EXPECT_EQ(json::parse(noticeText("\xff"))["text"], "\xef\xbf\xbd");
  EXPECT_TRUE(json::accept(errorText(ProtocolError(400, "", "\xff"))));
}

}  // namespace
}  // namespace scolopax::protocol
