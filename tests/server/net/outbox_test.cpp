// SPDX-License-Identifier: Apache-2.0
#include "server/net/outbox.h"

#include <gtest/gtest.h>

namespace scolopax::net {
namespace {

Frame frame(std::uint32_t number) { return {number, {}, nullptr}; }

/// Number of the frame that is sent next; 0 if there is none.
std::uint32_t nextFrame(Outbox& outbox) {
  const auto item = outbox.next();
  return item ? std::get<Frame>(*item).number : 0;
}

SharedText text(std::string given) { return std::make_shared<const std::string>(std::move(given)); }

TextLimits texts(std::size_t count) { return {count, 100, 1000, 10}; }

TEST(Outbox, SendsAtMostTwoUnacknowledgedFrames) {
  Outbox outbox(texts(4));
  for (std::uint32_t number = 1; number <= 2; ++number) {
    outbox.offer(frame(number));
    EXPECT_EQ(nextFrame(outbox), number);
  }
  outbox.offer(frame(3));
  EXPECT_EQ(nextFrame(outbox), 0U);
  outbox.acknowledge(1);
  EXPECT_EQ(nextFrame(outbox), 3U);
}

TEST(Outbox, KeepsOnlyTheLatestFrameThatWaits) {
  Outbox outbox(texts(4));
  for (std::uint32_t number = 1; number <= 5; ++number) outbox.offer(frame(number));
  EXPECT_EQ(nextFrame(outbox), 5U);
  EXPECT_EQ(nextFrame(outbox), 0U);
  EXPECT_EQ(outbox.stats().framesReplaced, 4U);
  EXPECT_EQ(outbox.stats().framesSent, 1U);
}

TEST(Outbox, TakesAnAcknowledgementForAllFramesBeforeIt) {
  Outbox outbox(texts(4));
  for (std::uint32_t number = 1; number <= 2; ++number) {
    outbox.offer(frame(number));
    nextFrame(outbox);
  }
  outbox.acknowledge(2);
  EXPECT_EQ(outbox.stats().unacknowledged, 0);
}

TEST(Outbox, IgnoresAcknowledgementsOfFramesThatAreNotOnTheirWay) {
  Outbox outbox(texts(4));
  for (std::uint32_t number = 1; number <= 2; ++number) {
    outbox.offer(frame(number));
    nextFrame(outbox);
  }
  for (const std::uint32_t number : {0U, 3U, 0xFFFFFFFFU}) outbox.acknowledge(number);
  EXPECT_EQ(outbox.stats().unacknowledged, 2);
  outbox.acknowledge(1);
  outbox.acknowledge(1);
  EXPECT_EQ(outbox.stats().unacknowledged, 1);
}

TEST(Outbox, KeepsCountWhenFrameNumbersWrapAround) {
  Outbox outbox(texts(4));
  outbox.offer(frame(0xFFFFFFFF));
  nextFrame(outbox);
  outbox.offer(frame(0));
  ASSERT_TRUE(outbox.next());
  outbox.acknowledge(0);
  EXPECT_EQ(outbox.stats().unacknowledged, 0);
}

TEST(Outbox, SendsTextsInOrderAndBeforeFrames) {
  Outbox outbox(texts(4));
  outbox.offer(frame(1));
  EXPECT_TRUE(outbox.pushText(text("a")));
  EXPECT_TRUE(outbox.pushText(text("b")));
  EXPECT_EQ(*std::get<SharedText>(*outbox.next()), "a");
  EXPECT_EQ(*std::get<SharedText>(*outbox.next()), "b");
  EXPECT_EQ(nextFrame(outbox), 1U);
}

TEST(Outbox, RefusesMoreTextsThanItsLimit) {
  Outbox outbox(texts(2));
  EXPECT_TRUE(outbox.pushText(text("a")));
  EXPECT_TRUE(outbox.pushText(text("b")));
  EXPECT_FALSE(outbox.pushText(text("c")));
  outbox.next();
  EXPECT_TRUE(outbox.pushText(text("d")));
}

TEST(Outbox, RefusesMoreBytesOfTextThanItsLimitButForASingleText) {
  Outbox outbox(texts(9));
  EXPECT_TRUE(outbox.pushText(text(std::string(900, 'x'))));
  EXPECT_FALSE(outbox.pushText(text("y")));
  outbox.next();
  EXPECT_TRUE(outbox.pushText(text("y")));  // one more may wait while the large one is being sent
  EXPECT_FALSE(outbox.pushText(text("z")));
  outbox.next();
  EXPECT_TRUE(outbox.pushText(text(std::string(50, 'x'))));
  EXPECT_TRUE(outbox.pushText(text(std::string(49, 'x'))));
  EXPECT_FALSE(outbox.pushText(text("y")));
}

TEST(Outbox, HoldsToTheLimitOfAllTogetherAlsoWithTextsThatAreAlone) {
  const auto all = std::make_shared<std::atomic<std::size_t>>(0);
  Outbox first(texts(9), all), second(texts(9), all);
  EXPECT_TRUE(first.pushText(text(std::string(900, 'x'))));
  EXPECT_FALSE(second.pushText(text(std::string(101, 'x'))));
  EXPECT_TRUE(second.pushText(text(std::string(100, 'x'))));
  first.next();
  EXPECT_FALSE(first.pushText(text(std::string(101, 'x'))));  // the first is still being sent
  EXPECT_EQ(*all, 1000U);
  first.next();
  EXPECT_EQ(*all, 100U);
}

TEST(Outbox, LeavesAFairShareToEachWhenAllTogetherHaveMoreThanTheyMay) {
  const auto all = std::make_shared<std::atomic<std::size_t>>(0);
  {
    Outbox greedy(texts(9), all), modest(texts(9), all);
    EXPECT_TRUE(greedy.pushText(text(std::string(1000, 'x'))));
    EXPECT_TRUE(modest.pushText(text("1234")));
    EXPECT_TRUE(modest.pushText(text("123456")));
    EXPECT_FALSE(modest.pushText(text("1")));
    EXPECT_EQ(*all, 1010U);
    greedy.close({1008, ""}, true);
    EXPECT_EQ(*all, 10U);
    EXPECT_TRUE(modest.pushText(text("1")));
    modest.next();
    EXPECT_EQ(*all, 11U);
  }
  EXPECT_EQ(*all, 0U);
}

TEST(Outbox, ClosesAfterTheTextsAndSendsNothingMore) {
  Outbox outbox(texts(4));
  outbox.offer(frame(1));
  outbox.pushText(text("last"));
  outbox.close({1000, "done"}, false);
  outbox.close({1001, "second"}, false);
  outbox.pushText(text("too late"));
  outbox.offer(frame(2));
  EXPECT_EQ(*std::get<SharedText>(*outbox.next()), "last");
  EXPECT_EQ(std::get<CloseMessage>(*outbox.next()).code, 1000);
  EXPECT_FALSE(outbox.next());
}

}  // namespace
}  // namespace scolopax::net
