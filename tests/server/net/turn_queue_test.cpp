// SPDX-License-Identifier: Apache-2.0
#include "server/net/turn_queue.h"

#include <gtest/gtest.h>

#include <string>

namespace scolopax::net {
namespace {

/// Takes all jobs that may begin, and ends them unless they must be left running.
std::string taken(TurnQueue<std::string>& queue, bool end = true) {
  std::string jobs;
  while (queue.ready()) {
    const auto turn = queue.take();
    jobs += turn.job + ' ';
    if (end) queue.end(turn.flow);
  }
  return jobs;
}

void pushAll(TurnQueue<std::string>& queue) {
  for (const char* job : {"a1", "a2", "a3", "b1", "b2", "c1"}) queue.push({job[0]}, job);
}

TEST(TurnQueue, LetsFlowsTakeTurns) {
  TurnQueue<std::string> queue(1);
  pushAll(queue);
  EXPECT_EQ(queue.waiting(), 6u);
  EXPECT_EQ(taken(queue), "a1 b1 c1 a2 b2 a3 ");
  EXPECT_TRUE(queue.idle());
}

TEST(TurnQueue, BeginsNoMoreJobsOfAFlowThanMayRunAtOnce) {
  TurnQueue<std::string> queue(2);
  pushAll(queue);
  EXPECT_EQ(taken(queue, false), "a1 b1 c1 a2 b2 ");
  EXPECT_EQ(queue.waiting(), 1u);
  queue.end("b");
  EXPECT_FALSE(queue.ready());
  queue.end("a");
  EXPECT_EQ(taken(queue, false), "a3 ");
}

TEST(TurnQueue, BeginsOthersOfAFlowWhileAJobIsPaused) {
  TurnQueue<std::string> queue(1);
  pushAll(queue);
  EXPECT_EQ(taken(queue, false), "a1 b1 c1 ");
  queue.pause("a");
  EXPECT_EQ(taken(queue, false), "a2 ");
  queue.resume("a");
  queue.end("a");
  EXPECT_FALSE(queue.ready());
  queue.end("a");
  EXPECT_EQ(taken(queue), "a3 ");
}

TEST(TurnQueue, LetsAJobLeave) {
  TurnQueue<std::string> queue(1);
  pushAll(queue);
  const auto is = [](const char* name) { return [name](const std::string& job) { return job == name; }; };
  EXPECT_EQ(queue.withdraw("a", is("a2")), "a2");
  EXPECT_EQ(queue.withdraw("a", is("a2")), std::nullopt);
  EXPECT_EQ(queue.withdraw("c", is("c1")), "c1");
  EXPECT_EQ(queue.withdraw("c", is("c1")), std::nullopt);
  EXPECT_EQ(queue.waiting(), 4u);
  EXPECT_EQ(taken(queue), "a1 b1 a3 b2 ");
  EXPECT_TRUE(queue.idle());
}

}  // namespace
}  // namespace scolopax::net
