// SPDX-License-Identifier: Apache-2.0
#include "server/pass_ends.h"

#include <gtest/gtest.h>

#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;

struct Ends {
  testing::FakeClock clock;
  int wakes = 0;
  PassEnds ends{clock.now(), [this] { ++wakes; }};
  TimePoint after(std::chrono::milliseconds time) { return clock.now()() + time; }
  bool ended(bool urgent) { return ends.flag(urgent); }
};

TEST(PassEnds, EndOnlyWhatIsNotUrgentForAnEdit) {
  Ends test;
  test.ends.interrupt();
  EXPECT_TRUE(test.ended(false));
  EXPECT_FALSE(test.ended(true));
  test.ends.reset();
  EXPECT_FALSE(test.ended(false));
}

TEST(PassEnds, EndEverythingFromTheStopOn) {
  Ends test;
  test.ends.stop();
  test.ends.reset();
  EXPECT_TRUE(test.ended(false));
  EXPECT_TRUE(test.ended(true));
}

TEST(PassEnds, EndAPassThatIsOverdue) {
  Ends test;
  const PassEnds::Watched watched(test.ends, test.after(100ms));
  EXPECT_EQ(test.wakes, 1);
  EXPECT_EQ(test.ends.watch(), test.after(100ms));
  test.clock.advance(99ms);
  EXPECT_EQ(test.ends.watch(), test.after(1ms));
  EXPECT_FALSE(test.ended(true));
  test.clock.advance(1ms);
  EXPECT_EQ(test.ends.watch(), std::nullopt);
  EXPECT_TRUE(test.ended(true));
  EXPECT_TRUE(test.ended(false));
}

TEST(PassEnds, WatchPassesThatEndInTimeWithoutBeingWokenForEach) {
  Ends test;
  for (int i = 0; i < 10; ++i) {
    const PassEnds::Watched watched(test.ends, test.after(100ms));
    test.clock.advance(10ms);
  }
  EXPECT_EQ(test.wakes, 1);
  EXPECT_EQ(test.ends.watch(), std::nullopt);  // there is no pass now
  const PassEnds::Watched longer(test.ends, test.after(100ms));
  EXPECT_EQ(test.wakes, 2);
  EXPECT_EQ(test.ends.watch(), test.after(100ms));
  {
    const PassEnds::Watched shorter(test.ends, test.after(50ms));
    EXPECT_EQ(test.wakes, 3);
  }
  test.clock.advance(100ms);
  EXPECT_EQ(test.ends.watch(), std::nullopt);
  EXPECT_FALSE(test.ended(true));
}

}  // namespace
}  // namespace scolopax::server
