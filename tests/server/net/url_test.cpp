// SPDX-License-Identifier: Apache-2.0
#include "server/net/url.h"

#include <gtest/gtest.h>

namespace scolopax::net {
namespace {

Request from(const std::string& origin, const std::string& host) {
  Request request;
  request.headers = {{"Origin", origin}, {"Host", host}};
  return request;
}

TEST(Target, IsSplitAndDecoded) {
  const auto target = parseTarget("/a%20b/%C3%BC+x?q=1%2B1&r=a+b&flag&q=2#fragment");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/a b/\xC3\xBC+x");
  EXPECT_EQ(target->query, (Query{{"q", "1+1"}, {"r", "a b"}, {"flag", ""}, {"q", "2"}}));
}

TEST(Target, IsRefusedWhenItIsNotAPathOrBadlyEncoded) {
  for (const char* bad : {"", "*", "http://host/", "a", "/%", "/%4", "/%zz", "/a%00b", "/?a=%g0", "/?%=1"}) {
    EXPECT_FALSE(parseTarget(bad)) << bad;
  }
}

TEST(Target, SurvivesEncodingAndDecodingForEveryByte) {
  std::string all;
  for (int byte = 1; byte < 256; ++byte) all += static_cast<char>(byte);
  EXPECT_EQ(percentDecode(percentEncodePath(all), false), all);
  EXPECT_EQ(percentDecode(percentEncodePath(all), true), all);
}

TEST(Origin, IsTheOwnOneWhenHostAndPortAgreeWhateverTheScheme) {
  EXPECT_TRUE(sameOrigin("http://localhost:8080", "localhost:8080"));
  EXPECT_TRUE(sameOrigin("https://Lab.Example", "lab.example"));
  EXPECT_FALSE(sameOrigin("http://localhost:8081", "localhost:8080"));
  EXPECT_FALSE(sameOrigin("http://evil.example", "localhost:8080"));
  EXPECT_FALSE(sameOrigin("null", "null"));
  EXPECT_FALSE(sameOrigin("http://", ""));
  EXPECT_FALSE(sameOrigin("http://localhost:8080.evil.example", "localhost:8080"));
}

TEST(Origin, HasAWebSchemeAndNothingButAHostAndAPort) {
  for (const char* origin : {"ftp://a:1", "file://a:1", "://a:1", "a:1", "http:/a:1", "http://a:1/",
                             "http://user@a:1", "http://a:1x", "http://a:", "http://a:1@a:1", "http://a :1",
                             "http://a:65537", "http://b@a:1", "x-http://a:1"})
    EXPECT_FALSE(sameOrigin(origin, "a:1")) << origin;
  EXPECT_FALSE(sameOrigin("ftp://evil@a", "evil@a"));
  EXPECT_FALSE(sameOrigin("http://evil@a", "evil@a"));
  EXPECT_TRUE(sameOrigin("https://a", "a:443"));
  EXPECT_TRUE(sameOrigin("http://a", "a:80"));
  EXPECT_FALSE(sameOrigin("https://a", "a:80"));
}

TEST(Authority, IsAHostAndMaybeAPort) {
  const auto host = [](std::string_view text) {
    const auto found = parseAuthority(text);
    return found ? std::string(found->host) : "";
  };
  EXPECT_EQ(host("lab.example"), "lab.example");
  EXPECT_EQ(host("127.0.0.1:8080"), "127.0.0.1");
  EXPECT_EQ(parseAuthority("a:8080")->port, 8080);
  EXPECT_EQ(host("[::1]:8080"), "[::1]");
  EXPECT_EQ(host("[::ffff:1.2.3.4]"), "[::ffff:1.2.3.4]");
  for (const char* bad :
       {"", ":80", "a:", "a:b", "a:-1", "a:65536", "a b", "a/b", "u@a", "localhost:80@evil.com",
        "[::1].evil.com", "[::1]x", "[::1", "[]", "[", "]", "[evil.com]", "a,b"})
    EXPECT_EQ(host(bad), "") << bad;
}

TEST(Origin, IsAllowedWhenMissingOwnOrListed) {
  const std::vector<std::string> listed{"https://lab.example"};
  EXPECT_TRUE(originAllowed(Request{}, {}));
  EXPECT_TRUE(originAllowed(from("http://a:1", "a:1"), {}));
  EXPECT_TRUE(originAllowed(from("https://lab.example", "127.0.0.1:8080"), listed));
  EXPECT_FALSE(originAllowed(from("http://lab.example", "127.0.0.1:8080"), listed));
  EXPECT_FALSE(originAllowed(from("null", "a:1"), listed));
  Request twice = from("http://a:1", "a:1");
  twice.headers.emplace("origin", "http://evil.example");
  EXPECT_FALSE(originAllowed(twice, {}));
}

}  // namespace
}  // namespace scolopax::net
