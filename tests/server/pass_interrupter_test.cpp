// SPDX-License-Identifier: Apache-2.0
#include "server/pass_interrupter.h"

#include <gtest/gtest.h>

#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;

struct Interrupted {
  testing::FakeClock clock;
  int wakes = 0;
  PassInterrupter interrupter{clock.now(), [this] { ++wakes; }};
  TimePoint after(std::chrono::milliseconds time) { return clock.now()() + time; }
  bool ended(bool urgent) { return interrupter.flag(urgent); }
};

TEST(PassInterrupter, EndsOnlyPassesThatAreNotUrgentForAnEdit) {
  Interrupted test;
  test.interrupter.interrupt();
  EXPECT_TRUE(test.ended(false));
  EXPECT_FALSE(test.ended(true));
  test.interrupter.reset();
  EXPECT_FALSE(test.ended(false));
}

TEST(PassInterrupter, EndsAllPassesOnceStopped) {
  Interrupted test;
  test.interrupter.stop();
  test.interrupter.reset();
  EXPECT_TRUE(test.ended(false));
  EXPECT_TRUE(test.ended(true));
}

TEST(PassInterrupter, EndsAPassThatIsOverdue) {
  Interrupted test;
  const PassInterrupter::Watched watched(test.interrupter, test.after(100ms));
  EXPECT_EQ(test.wakes, 1);
  EXPECT_EQ(test.interrupter.watch(), test.after(100ms));
  test.clock.advance(99ms);
  EXPECT_EQ(test.interrupter.watch(), test.after(1ms));
  EXPECT_FALSE(test.ended(true));
  test.clock.advance(1ms);
  EXPECT_EQ(test.interrupter.watch(), std::nullopt);
  EXPECT_TRUE(test.ended(true));
  EXPECT_TRUE(test.ended(false));
}

TEST(PassInterrupter, WatchesPassesThatEndInTimeWithoutBeingWokenForEach) {
  Interrupted test;
  for (int i = 0; i < 10; ++i) {
    const PassInterrupter::Watched watched(test.interrupter, test.after(100ms));
    test.clock.advance(10ms);
  }
  EXPECT_EQ(test.wakes, 1);
  EXPECT_EQ(test.interrupter.watch(), std::nullopt);  // there is no pass now
  const PassInterrupter::Watched longer(test.interrupter, test.after(100ms));
  EXPECT_EQ(test.wakes, 2);
  EXPECT_EQ(test.interrupter.watch(), test.after(100ms));
  {
    const PassInterrupter::Watched shorter(test.interrupter, test.after(50ms));
    EXPECT_EQ(test.wakes, 3);
  }
  test.clock.advance(100ms);
  EXPECT_EQ(test.interrupter.watch(), std::nullopt);
  EXPECT_FALSE(test.ended(true));
}

}  // namespace
}  // namespace scolopax::server
