// SPDX-License-Identifier: Apache-2.0
#include "renderer/core/memory_budget.h"

#include <gtest/gtest.h>

#include <string>

#include "renderer/core/error.h"
#include "renderer/data/film.h"

namespace scolopax {
namespace {

constexpr std::uint64_t kMiB = 1 << 20;

std::shared_ptr<MemoryBudget> budgetOf(std::uint64_t mebibytes) {
  return std::make_shared<MemoryBudget>(mebibytes * kMiB);
}

/// Code and message of the Error by which a request is refused.
std::pair<ErrorCode, std::string> refusal(const std::shared_ptr<MemoryBudget>& budget,
                                          std::uint64_t mebibytes) {
  try {
    MemoryBudget::take(budget, MemoryUse::films, mebibytes * kMiB);
  } catch (const Error& error) {
    return {error.code(), error.what()};
  }
  return {ErrorCode::io, ""};
}

TEST(MemoryBudget, CountsWhatIsHeldByUse) {
  const auto budget = budgetOf(100);
  {
    auto films = MemoryBudget::take(budget, MemoryUse::films, 10);
    const auto grids = MemoryBudget::takeShared(budget, MemoryUse::grids, 20);
    MemoryBudget::Share moved = std::move(films);
    moved.resize(15);
    EXPECT_EQ(budget->used(MemoryUse::films), 15u);
    EXPECT_EQ(budget->used(MemoryUse::grids), 20u);
    moved = MemoryBudget::Share();
    EXPECT_EQ(budget->used(MemoryUse::films), 0u);
  }
  EXPECT_EQ(budget->used(MemoryUse::grids), 0u);
}

TEST(MemoryBudget, RefusesWithTheNumbersWhatIsTooLargeAndWhatOthersHold) {
  const auto budget = budgetOf(100);
  EXPECT_EQ(refusal(budget, 101),
            std::pair(ErrorCode::tooLarge,
                      std::string("memory for films: expected at most 100 MiB, found 101 MiB")));
  const auto held = MemoryBudget::take(budget, MemoryUse::pictures, 60 * kMiB);
  EXPECT_EQ(refusal(budget, 41),
            std::pair(ErrorCode::busy,
                      std::string("memory for films: expected at most 100 MiB, of which 60 MiB are in use, "
                                  "found 41 MiB")));
  EXPECT_EQ(refusal(budget, 40).first, ErrorCode::io);
}

TEST(MemoryBudget, HasMemoryReleasedBeforeItRefuses) {
  const auto budget = budgetOf(100);
  std::vector<MemoryBudget::Share> spare;
  for (int i = 0; i < 3; ++i) spare.push_back(MemoryBudget::take(budget, MemoryUse::films, 30 * kMiB));
  int asked = 0;
  budget->setRelease([&] {
    ++asked;
    if (spare.empty()) return false;
    spare.pop_back();
    return true;
  });
  EXPECT_EQ(refusal(budget, 101).first, ErrorCode::tooLarge);  // releasing would not help
  EXPECT_EQ(asked, 0);
  const auto held = MemoryBudget::take(budget, MemoryUse::grids, 60 * kMiB);
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(refusal(budget, 50).first, ErrorCode::busy);
  EXPECT_EQ(asked, 4);
  EXPECT_TRUE(spare.empty());
}

TEST(MemoryBudget, ReleasesMemoryAlsoForWhatIsNotChargedToIt) {
  const auto budget = budgetOf(100);
  EXPECT_FALSE(budget->releaseSome());
  int left = 1;
  budget->setRelease([&] { return left-- > 0; });
  EXPECT_TRUE(budget->releaseSome());
  EXPECT_FALSE(budget->releaseSome());
}

TEST(MemoryBudget, StaysAsItWasWhenAShareCannotGrow) {
  const auto budget = budgetOf(100);
  auto share = MemoryBudget::take(budget, MemoryUse::films, 60 * kMiB);
  EXPECT_THROW(share.resize(200 * kMiB), Error);
  EXPECT_EQ(share.bytes(), 60 * kMiB);
  EXPECT_EQ(budget->used(MemoryUse::films), 60 * kMiB);
  share.resize(90 * kMiB);  // its previous size does not count against it
}

TEST(MemoryBudget, LeavesTheLastQuarterToOrdinaryShares) {
  const auto budget = budgetOf(2000);
  const auto large = MemoryBudget::take(budget, MemoryUse::films, 1400 * kMiB);
  EXPECT_EQ(refusal(budget, 257).first, ErrorCode::busy);
  const auto ordinary = MemoryBudget::take(budget, MemoryUse::films, 256 * kMiB);
  EXPECT_EQ(refusal(budget, 256).first, ErrorCode::io);
  EXPECT_EQ(refusal(budget, 1501).first, ErrorCode::tooLarge);
}

TEST(MemoryBudget, TakesAFullHdFilmForAnOrdinaryOne) {
  EXPECT_LE(1920 * 1080 * (Film::kPixelBytes + 1), MemoryBudget::kOrdinaryBytes);
}

TEST(MemoryBudget, GrantsEverythingWhereThereIsNone) {
  auto share = MemoryBudget::take(nullptr, MemoryUse::films, ~std::uint64_t(0));
  share.resize(1);
}

}  // namespace
}  // namespace scolopax
