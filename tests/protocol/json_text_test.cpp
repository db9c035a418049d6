// SPDX-License-Identifier: Apache-2.0
#include "protocol/json_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "protocol/problem.h"

namespace scolopax::protocol {
namespace {

/// The status of the error that parsing the text throws; 0 if it throws none.
int refusal(std::string_view text, const Limits& limits = {}) {
  try {
    parseJson(text, limits);
  } catch (const ProtocolError& error) {
    return error.status;
  }
  return 0;
}

std::string nested(std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); }

TEST(ParseJson, ReadsADocument) { EXPECT_EQ(parseJson(R"({"a": [1, "x"]})")["a"][1], "x"); }

TEST(ParseJson, RefusesWhatIsNotJson) {
  for (const char* text :
       {"", " ", "{", "{]", "{\"a\":}", "[1,]", "nul", "{} {}", "NaN", "'a'", "\"\\u12\""}) {
    EXPECT_EQ(refusal(text), 400) << text;
  }
}

TEST(ParseJson, RefusesWhatIsNotUtf8) {
  EXPECT_EQ(refusal("{\"a\": \"\xff\xfe\"}"), 400);
  EXPECT_EQ(refusal("{\"a\": \"\xc3\"}"), 400);
  EXPECT_EQ(refusal("{\"a\": \"\xed\xa0\x80\"}"), 400) << "a surrogate";
  EXPECT_EQ(refusal(std::string("\0", 1)), 400);
}

TEST(ParseJson, RefusesNumbersBeyondADouble) { EXPECT_EQ(refusal("[1e999]"), 400); }

TEST(ParseJson, RefusesDepthBombsBeforeParsing) {
  EXPECT_EQ(refusal(nested(32)), 0);
  EXPECT_EQ(refusal(nested(33)), 400);
  EXPECT_EQ(refusal(std::string(1 << 20, '[')), 400);
  std::string objects;
  for (int i = 0; i < 33; ++i) objects += "{\"a\":";
  EXPECT_EQ(refusal(objects + "1" + std::string(33, '}')), 400);
}

TEST(ParseJson, CountsNoBracketsInTexts) {
  EXPECT_EQ(refusal('"' + std::string(100, '[') + '"'), 0);
  EXPECT_EQ(refusal(R"("\"[[[[")", {.depth = 1}), 0);
  EXPECT_EQ(refusal(R"(["\\", [1]])", {.depth = 1}), 400);
}

TEST(ParseJson, RefusesDocumentsBeyondTheLimit) {
  EXPECT_EQ(refusal("[1, 2]", {.bytes = 6}), 0);
  EXPECT_EQ(refusal("[1, 2]", {.bytes = 5}), 413);
}

TEST(ParseJson, TakesTheLastOfEqualKeys) { EXPECT_EQ(parseJson(R"({"a": 1, "a": 2})")["a"], 2); }

}  // namespace
}  // namespace scolopax::protocol
