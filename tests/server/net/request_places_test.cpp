// SPDX-License-Identifier: Apache-2.0
#include "server/net/request_places.h"

#include <gtest/gtest.h>

#include <vector>

namespace scolopax::net {
namespace {

TEST(RequestPlaces, AreForSoManyLongRequestsAtMostAQuarterOfThemOfQuickRoutes) {
  RequestPlaces places(8, 1);
  std::vector<RequestPlaces::Place> quick{places.takeLong(true), places.takeLong(true)}, others;
  EXPECT_NE(quick.back(), nullptr);
  EXPECT_EQ(places.takeLong(true), nullptr);
  for (int i = 0; i < 6; ++i) others.push_back(places.takeLong(false));
  EXPECT_NE(others.back(), nullptr);
  EXPECT_EQ(places.takeLong(false), nullptr);
  quick.pop_back();
  EXPECT_NE(places.takeLong(true), nullptr);
  others.push_back(places.takeLong(false));
  EXPECT_NE(others.back(), nullptr);
  EXPECT_EQ(places.takeLong(true), nullptr) << "all are taken";
}

TEST(RequestPlaces, AreForSoManyWaitingRequestsOfEachFlow) {
  RequestPlaces places(1, 2);
  const auto first = places.takeWaiting("a");
  auto second = places.takeWaiting("a");
  EXPECT_NE(second, nullptr);
  EXPECT_EQ(places.takeWaiting("a"), nullptr);
  EXPECT_NE(places.takeWaiting("b"), nullptr);
  second.reset();
  EXPECT_NE(places.takeWaiting("a"), nullptr);
}

}  // namespace
}  // namespace scolopax::net
