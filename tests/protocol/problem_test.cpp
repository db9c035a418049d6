// SPDX-License-Identifier: Apache-2.0
#include "protocol/problem.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace scolopax::protocol {
namespace {

using nlohmann::json;

TEST(ProblemJson, HoldsTheMembersOfRfc9457AndThePointer) {
  EXPECT_EQ(json::parse(problemJson(ProtocolError(422, "/image/width", "too wide"))),
            json::parse(R"({"type": "about:blank", "title": "Unprocessable Content", "status": 422,
                            "detail": "too wide", "pointer": "/image/width"})"));
}

TEST(ProblemJson, LeavesOutThePointerOfTheWholeDocument) {
  EXPECT_FALSE(json::parse(problemJson(404, "no such session")).contains("pointer"));
}

TEST(ProblemJson, ReplacesBytesThatAreNotUtf8) {
  EXPECT_EQ(json::parse(problemJson(400, "a\xff"))["detail"], "a\xef\xbf\xbd");
}

TEST(ProblemJson, EchoesNoMoreThanALineOfWhatItWasSent) {
  EXPECT_EQ(shortened("short"), "short");
  EXPECT_EQ(shortened("12345678", 8), "12345678");
  EXPECT_EQ(shortened("123456789", 8), "12345...");
  EXPECT_EQ(shortened("1234\xC3\xBC"
                      "6789",
                      8),
            "1234...");  // does not cut a character in half
  const std::string key(1 << 20, 'k');
  EXPECT_LT(problemJson(ProtocolError(422, "/" + key, key)).size(), 2000u);
}

}  // namespace
}  // namespace scolopax::protocol
