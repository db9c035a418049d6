// SPDX-License-Identifier: Apache-2.0
#include "server/net/router.h"

#include <gtest/gtest.h>

namespace scolopax::net {
namespace {

Route route(int status) {
  return {[status](const Request&) { return Response{status, "", "", {}}; }, RouteKind::quick};
}

int statusOf(const RouteMatch& match) { return match.route ? match.route->handler(Request{}).status : 0; }

TEST(Router, PicksTheFirstPatternThatFitsTheWholePathAndReturnsItsGroups) {
  Router router;
  router.add("GET", "/things/([^/]+)", route(1));
  router.add("GET", "/things/(.*)", route(2));
  const RouteMatch one = router.find("GET", "/things/a b+\xC3\xBC%");
  EXPECT_EQ(statusOf(one), 1);
  EXPECT_EQ(one.matches, (std::vector<std::string>{"/things/a b+\xC3\xBC%", "a b+\xC3\xBC%"}));
  EXPECT_EQ(statusOf(router.find("GET", "/things/a/b")), 2);
  EXPECT_EQ(statusOf(router.find("GET", "/other/things/a")), 0);
}

TEST(Router, KnowsEveryMethodAndAnswersHeadByGet) {
  Router router;
  int status = 1;
  for (const char* method : {"GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
    router.add(method, "/x", route(status++));
  status = 1;
  for (const char* method : {"GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"}) {
    EXPECT_EQ(statusOf(router.find(method, "/x")), status++) << method;
  }
  EXPECT_EQ(statusOf(router.find("HEAD", "/x")), 1);
}

TEST(Router, SaysWhichMethodsAPathHas) {
  Router router;
  router.add("GET", "/x", route(1));
  router.add("PATCH", "/x", route(2));
  EXPECT_EQ(router.find("DELETE", "/x").allow, "GET, HEAD, PATCH");
  EXPECT_EQ(router.find("DELETE", "/y").allow, "");
}

TEST(Router, LetsTheFirstPatternThatFitsDecideWhichMethodsThereAre) {
  Router router;
  router.add("GET", "/things/([^/]+)", route(1));
  router.add("POST", "/things/(.*)", route(2));
  router.add("PUT", "/things/([^/]+)", route(3));
  EXPECT_EQ(statusOf(router.find("PUT", "/things/a")), 3);
  EXPECT_EQ(router.find("POST", "/things/a").allow, "GET, HEAD, PUT");
  EXPECT_EQ(statusOf(router.find("POST", "/things/a/b")), 2);
}

TEST(Router, RefusesUnknownMethodsAndBrokenPatterns) {
  Router router;
  EXPECT_THROW(router.add("BREW", "/x", route(1)), NetError);
  EXPECT_THROW(router.add("GET", "/(", route(1)), NetError);
}

TEST(Router, TakesTheLongestPathThatTheServerLetsThrough) {
  Router router;
  router.add("GET", "/([^/]+)", route(1));
  EXPECT_EQ(statusOf(router.find("GET", "/" + std::string(2047, '%'))), 1);
}

}  // namespace
}  // namespace scolopax::net
