// SPDX-License-Identifier: Apache-2.0
#include "server/unsent_answers.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "renderer/core/error.h"

namespace scolopax::server {
namespace {

constexpr std::uint64_t kMiB = 1 << 20;

/// Answers that nobody reads, with a budget of 64 MiB: 16 MiB for answers, 8 of them for one flow.
struct Unread {
  std::shared_ptr<MemoryBudget> memory = std::make_shared<MemoryBudget>(64 * kMiB);
  UnsentAnswers answers{memory};
  std::vector<std::shared_ptr<const void>> held;

  /// The reason why the flow gets no memory for another answer; empty if it gets memory.
  std::string refusal(const std::string& flow, std::uint64_t bytes) {
    try {
      held.push_back(answers.take(flow, bytes));
      return "";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), bytes > 16 * kMiB ? ErrorCode::tooLarge : ErrorCode::busy);
      return error.what();
    }
  }
  std::uint64_t used() const { return memory->used(MemoryUse::answers); }
};

TEST(UnsentAnswers, AreChargedUntilTheyHaveBeenSentIfTheyAreLong) {
  Unread unread;
  EXPECT_EQ(unread.answers.take("a", MemoryBudget::kFreeBytes), nullptr);
  auto answer = unread.answers.take("a", 100'000);
  EXPECT_EQ(unread.used(), 100'000u);
  answer.reset();
  EXPECT_EQ(unread.used(), 0u);
  EXPECT_EQ(UnsentAnswers(nullptr).take("a", ~std::uint64_t(0)), nullptr);
}

TEST(UnsentAnswers, LeaveMostOfTheMemoryToOtherUsesHoweverManyClientsThereAre) {
  Unread unread;
  for (const char* flow : {"a", "b", "c", "d"}) EXPECT_EQ(unread.refusal(flow, 4 * kMiB), "");
  EXPECT_EQ(
      unread.refusal("e", 4 * kMiB),
      "memory for answers to all clients: expected at most 16 MiB, of which 16 MiB have not been read, found "
      "4 MiB");
  EXPECT_EQ(unread.used(), 16 * kMiB);
  EXPECT_NO_THROW(MemoryBudget::take(unread.memory, MemoryUse::films, 48 * kMiB));
  unread.held.pop_back();
  EXPECT_EQ(unread.refusal("e", 4 * kMiB), "");
}

TEST(UnsentAnswers, OfOneClientLeaveRoomForThoseOfOthers) {
  Unread unread;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(unread.refusal("a", 4 * kMiB), "");
  EXPECT_EQ(
      unread.refusal("a", 2 * kMiB),
      "memory for answers to one session or address: expected at most 8 MiB, of which 8 MiB have not been "
      "read, found 2 MiB");
  EXPECT_EQ(unread.refusal("b", 2 * kMiB), "");
}

TEST(UnsentAnswers, MayBeSingleLargeOnesButNotLargerThanThereIsMemoryForAll) {
  Unread unread;
  EXPECT_EQ(unread.refusal("a", 12 * kMiB), "");
  EXPECT_NE(unread.refusal("a", 2 * kMiB), "");
  EXPECT_EQ(unread.refusal("b", 17 * kMiB),
            "memory for answers to all clients: expected at most 16 MiB, found 17 MiB");
}

TEST(UnsentAnswers, OfOrdinarySizeAreTakenWhileOthersHoldAllTheMemoryForAnswers) {
  Unread unread;
  EXPECT_EQ(unread.refusal("a", 16 * kMiB), "");
  EXPECT_NE(unread.refusal("b", 2 * kMiB), "");
  for (int i = 0; i < 2; ++i) EXPECT_EQ(unread.refusal("b", kMiB / 2), "");
  EXPECT_NE(unread.refusal("b", kMiB / 2), "");
}

TEST(UnsentAnswers, CountNothingThatTheBudgetRefuses) {
  Unread unread;
  auto films = std::make_optional(MemoryBudget::take(unread.memory, MemoryUse::films, 63 * kMiB));
  for (int i = 0; i < 9; ++i) EXPECT_NE(unread.refusal("a", 2 * kMiB), "");
  films.reset();
  EXPECT_EQ(unread.refusal("a", 8 * kMiB), "");
  EXPECT_EQ(unread.used(), 8 * kMiB);
}

}  // namespace
}  // namespace scolopax::server
