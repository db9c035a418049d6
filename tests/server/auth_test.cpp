// SPDX-License-Identifier: Apache-2.0
#include "server/auth.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

namespace scolopax {
namespace {

using net::Request;
using net::Response;

const std::string kToken = "0123456789abcdefTOKEN";

class AuthorizerTest : public testing::Test {
 protected:
  static Request request(const std::string& method, const std::string& path) {
    Request made;
    made.method = method;
    made.path = path;
    made.headers.emplace("Host", "127.0.0.1:8080");
    return made;
  }
  Request withCookie(const std::string& method, const std::string& path) const {
    Request made = request(method, path);
    made.headers.emplace("Cookie", "other=1; " + authorizer_.cookieName() + "=" + kToken + "; more=2");
    return made;
  }
  /// 0: allowed.
  int status(const Request& asked) const {
    const auto refused = authorizer_(asked);
    return refused ? refused->status : 0;
  }

  Authorizer authorizer_{kToken, true, {"https://lab.example"}};
};

std::string headerOf(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) return value;
  }
  return "";
}

TEST_F(AuthorizerTest, RefusesWithoutATokenAndSaysHow) {
  for (const char* path : {"/", "/metrics", "/api/v1/datasets", "/healthz/", "/HEALTHZ"}) {
    const auto refused = authorizer_(request("GET", path));
    ASSERT_TRUE(refused) << path;
    EXPECT_EQ(refused->status, 401);
    EXPECT_EQ(refused->contentType, "application/problem+json");
    EXPECT_EQ(headerOf(*refused, "WWW-Authenticate"), "Bearer");
    EXPECT_EQ(refused->body.find(kToken), std::string::npos);
  }
}

TEST_F(AuthorizerTest, MakesTheCookieForTlsAloneWhereTlsIsSpoken) {
  for (const bool tls : {false, true}) {
    Request asked = request("GET", "/");
    asked.query.emplace("token", kToken);
    const auto answer = Authorizer(kToken, true, {}, tls)(asked);
    ASSERT_TRUE(answer);
    EXPECT_EQ(headerOf(*answer, "Set-Cookie").find("; Secure") != std::string::npos, tls);
  }
}

TEST_F(AuthorizerTest, LeavesHealthAndReadinessOpenForReading) {
  for (const char* path : {"/healthz", "/readyz"}) {
    EXPECT_EQ(status(request("GET", path)), 0);
    EXPECT_EQ(status(request("HEAD", path)), 0);
    EXPECT_EQ(status(request("POST", path)), 401);
  }
}

TEST_F(AuthorizerTest, TakesTheBearerTokenForAnyMethod) {
  for (const char* method : {"GET", "POST", "PATCH", "DELETE"}) {
    Request asked = request(method, "/api/v1/sessions");
    asked.headers.emplace("Authorization", "bearer " + kToken);
    EXPECT_EQ(status(asked), 0) << method;
  }
  for (const std::string& wrong : {"Bearer " + kToken + "x", "Bearer " + kToken.substr(1), "Basic " + kToken,
                                   kToken, std::string("Bearer"), std::string("Bearer "), std::string()}) {
    Request asked = request("GET", "/");
    asked.headers.emplace("Authorization", wrong);
    EXPECT_EQ(status(asked), 401) << wrong;
  }
}

TEST_F(AuthorizerTest, TakesTheTokenFromTheUrlForReadingOnly) {
  Request stream = request("GET", "/api/v1/sessions/1/stream");
  stream.query.emplace("token", kToken);
  EXPECT_EQ(status(stream), 0);
  Request write = request("POST", "/api/v1/render");
  write.query.emplace("token", kToken);
  EXPECT_EQ(status(write), 401);
  Request wrong = request("GET", "/");
  wrong.query.emplace("token", kToken + "x");
  EXPECT_EQ(status(wrong), 401);
}

TEST_F(AuthorizerTest, TurnsTheTokenInThePagesUrlIntoACookie) {
  Request page = request("GET", "/");
  page.query = {{"token", kToken}, {"session", "a b&c"}};
  const auto redirect = authorizer_(page);
  ASSERT_TRUE(redirect);
  EXPECT_EQ(redirect->status, 303);
  EXPECT_EQ(headerOf(*redirect, "Location"), "./?session=a%20b%26c");
  EXPECT_EQ(headerOf(*redirect, "Set-Cookie"),
            authorizer_.cookieName() + "=" + kToken + "; HttpOnly; SameSite=Strict; Path=/");
  page.query = {{"token", kToken}};
  EXPECT_EQ(headerOf(*authorizer_(page), "Location"), "./");
}

TEST_F(AuthorizerTest, TellsServersApartByTheCookiesName) {
  // The first bytes of SHA-256("abc"), FIPS 180-2, appendix B.1.
  EXPECT_EQ(Authorizer("abc", true).cookieName(), "scolopax-ba7816bf");
  EXPECT_NE(authorizer_.cookieName(), Authorizer("another token", true).cookieName());
}

TEST_F(AuthorizerTest, TakesTheCookieForReading) {
  EXPECT_EQ(status(withCookie("GET", "/")), 0);
  EXPECT_EQ(status(withCookie("HEAD", "/metrics")), 0);
  Request wrong = request("GET", "/");
  wrong.headers.emplace("Cookie", authorizer_.cookieName() + "=" + kToken + "x");
  wrong.headers.emplace("Cookie", "x" + authorizer_.cookieName() + "=" + kToken);
  wrong.headers.emplace("Cookie", ";;=;" + authorizer_.cookieName());
  EXPECT_EQ(status(wrong), 401);
}

TEST_F(AuthorizerTest, TakesTheCookieForWritingFromTheOwnPageOnly) {
  for (const char* method : {"POST", "PUT", "PATCH", "DELETE", "OPTIONS"}) {
    EXPECT_EQ(status(withCookie(method, "/api/v1/sessions")), 403) << "no Origin";
    for (const char* origin : {"http://evil.example", "null", "http://127.0.0.1:8081", "http://127.0.0.1",
                               "ftp://127.0.0.1:8080", "http://127.0.0.1:8080/"}) {
      Request asked = withCookie(method, "/api/v1/sessions");
      asked.headers.emplace("Origin", origin);
      EXPECT_EQ(status(asked), 403) << origin;
    }
    for (const char* origin : {"http://127.0.0.1:8080", "https://lab.example"}) {
      Request asked = withCookie(method, "/api/v1/sessions");
      asked.headers.emplace("Origin", origin);
      EXPECT_EQ(status(asked), 0) << origin;
    }
  }
}

TEST_F(AuthorizerTest, KnowsThoseWhoShowTheTokenAndNotThoseForWhomADoorIsOpen) {
  EXPECT_TRUE(authorizer_.knows(withCookie("GET", "/")));
  Request open = request("GET", "/healthz");
  EXPECT_EQ(status(open), 0);
  EXPECT_FALSE(authorizer_.knows(open));
  open.headers.emplace("Authorization", "Bearer " + kToken);
  EXPECT_TRUE(authorizer_.knows(open));
}

TEST_F(AuthorizerTest, RefusesForeignHostNamesOnLoopback) {
  const auto statusFor = [](const Authorizer& authorizer, const std::string& host) {
    Request asked;
    asked.method = "GET";
    asked.path = "/healthz";
    asked.headers.emplace("Host", host);
    const auto refused = authorizer(asked);
    return refused ? refused->status : 0;
  };
  for (const char* host :
       {"localhost", "LOCALHOST:1", "127.0.0.1", "127.0.0.1:8080", "[::1]", "[::1]:8080", "lab.example"}) {
    EXPECT_EQ(statusFor(authorizer_, host), 0) << host;
  }
  for (const char* host : {"evil.example", "evil.example:8080", "127.evil.example", "localhost.evil.example",
                           "[::2]", "", "127.0.0.1@evil.example", "[::1].evil.example",
                           "localhost:80@evil.example", "127.0.0.1:80:90", "localhost:"}) {
    EXPECT_EQ(statusFor(authorizer_, host), 421) << host;
    EXPECT_EQ(statusFor(Authorizer(kToken, false), host), 0) << host;
  }
}

TEST(Token, IsLongRandomAndUrlSafe) {
  std::set<std::string> seen;
  for (int i = 0; i < 100; ++i) {
    const std::string token = createToken();
    EXPECT_EQ(token.size(), 43U);
    EXPECT_EQ(token.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"),
              std::string::npos);
    EXPECT_TRUE(seen.insert(token).second);
  }
}

TEST(Token, IsComparedWhole) {
  EXPECT_TRUE(sameToken("abc", "abc"));
  EXPECT_FALSE(sameToken("abc", "abd"));
  EXPECT_FALSE(sameToken("abc", "abcd"));
  EXPECT_FALSE(sameToken("", "a"));
}

class TokenFile : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  std::string read(const std::string& text) const {
    std::ofstream(path_, std::ios::binary) << text;
    return readTokenFile(path_);
  }
  std::string path_ = testing::TempDir() + "token_" + std::to_string(::getpid());
};

TEST_F(TokenFile, IsOneLineOfTokenCharacters) {
  EXPECT_EQ(read("0123456789abcdef"), "0123456789abcdef");
  EXPECT_EQ(read("0123456789abcdef\n"), "0123456789abcdef");
  EXPECT_EQ(read("AZaz09-._~+/=AZaz\r\n"), "AZaz09-._~+/=AZaz");
  EXPECT_EQ(read(std::string(512, 'x') + "\n").size(), 512U);
}

TEST_F(TokenFile, IsRefusedByNameWhenItIsShortLongOrHoldsAnythingElse) {
  for (const std::string& bad :
       {std::string(), std::string("\n"), std::string("0123456789abcde"), std::string("0123456789abcde\n\n"),
        std::string("                    "), std::string("0123456789 abcdef"),
        std::string("0123456789abcdef\nsecond"), std::string("0123456789abcdef;x"),
        std::string("0123456789abcdef\0x", 18), std::string(513, 'x'), std::string(100'000, 'x')}) {
    try {
      read(bad);
      ADD_FAILURE() << "took " << bad.substr(0, 40);
    } catch (const TokenError& error) {
      EXPECT_NE(std::string(error.what()).find(path_), std::string::npos);
      if (bad.size() > 2) {
        EXPECT_EQ(std::string(error.what()).find(bad), std::string::npos) << "tells no secret";
      }
    }
  }
  EXPECT_THROW(readTokenFile(path_ + ".none"), TokenError);
  EXPECT_THROW(readTokenFile(testing::TempDir()), TokenError);
}

TEST(TokenUrl, CanBeOpenedAsItStands) {
  EXPECT_EQ(tokenUrl("127.0.0.1", 8080, "a+/=", false), "http://127.0.0.1:8080/?token=a%2B/%3D");
  EXPECT_EQ(tokenUrl("::1", 1, "a", true), "https://[::1]:1/?token=a");
  EXPECT_EQ(tokenUrl("0.0.0.0", 1, "a", false), "http://127.0.0.1:1/?token=a");
}

TEST(Loopback, IsThisMachineAlone) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "localhost", "::1"})
    EXPECT_TRUE(isLoopback(host)) << host;
  for (const char* host : {"0.0.0.0", "::", "192.168.0.1", "127.example", "lab.example"})
    EXPECT_FALSE(isLoopback(host)) << host;
}

}  // namespace
}  // namespace scolopax
