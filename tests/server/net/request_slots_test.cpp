// SPDX-License-Identifier: Apache-2.0
#include "server/net/request_slots.h"

#include <gtest/gtest.h>

#include <vector>

namespace scolopax::net {
namespace {

TEST(RequestSlots, AreForSoManyLongRequestsAtMostAQuarterOfThemOfQuickRoutes) {
  RequestSlots slots(8, 1);
  std::vector<RequestSlots::Slot> quick{slots.takeLong(true), slots.takeLong(true)}, others;
  EXPECT_NE(quick.back(), nullptr);
  EXPECT_EQ(slots.takeLong(true), nullptr);
  for (int i = 0; i < 6; ++i) others.push_back(slots.takeLong(false));
  EXPECT_NE(others.back(), nullptr);
  EXPECT_EQ(slots.takeLong(false), nullptr);
  quick.pop_back();
  EXPECT_NE(slots.takeLong(true), nullptr);
  others.push_back(slots.takeLong(false));
  EXPECT_NE(others.back(), nullptr);
  EXPECT_EQ(slots.takeLong(true), nullptr) << "all are taken";
}

TEST(RequestSlots, AreForSoManyWaitingRequestsOfEachFlow) {
  RequestSlots slots(1, 2);
  const auto first = slots.takeWaiting("a");
  auto second = slots.takeWaiting("a");
  EXPECT_NE(second, nullptr);
  EXPECT_EQ(slots.takeWaiting("a"), nullptr);
  EXPECT_NE(slots.takeWaiting("b"), nullptr);
  second.reset();
  EXPECT_NE(slots.takeWaiting("a"), nullptr);
}

}  // namespace
}  // namespace scolopax::net
