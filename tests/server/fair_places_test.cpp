// SPDX-License-Identifier: Apache-2.0
#include "server/fair_places.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;

/// Places, with those that each client has.
struct Shared {
  testing::FakeClock clock;
  FairPlaces places;
  std::map<std::string, std::vector<FairPlaces::Place>> taken;

  explicit Shared(std::size_t most) : places(most, clock.now()) {}
  bool take(const std::string& client) {
    auto place = places.take(client);
    if (!place) return false;
    taken[client].push_back(std::move(place));
    return true;
  }
  void giveBack(const std::string& client) { taken[client].pop_back(); }
};

TEST(FairPlaces, AreAllForOneClientWhileNoOtherWaits) {
  Shared shared(3);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(shared.take("a"));
  EXPECT_FALSE(shared.take("a"));
  shared.giveBack("a");
  EXPECT_TRUE(shared.take("a"));
  EXPECT_EQ(shared.places.most(), 3u);
}

TEST(FairPlaces, ThatBecomeFreeAreForTheClientWithTheFewest) {
  Shared shared(4);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(shared.take("a"));
  for (const std::size_t mine : {0, 1}) {
    EXPECT_EQ(shared.taken["b"].size(), mine);
    EXPECT_FALSE(shared.take("b"));
    shared.giveBack("a");
    EXPECT_FALSE(shared.take("a"));
    EXPECT_TRUE(shared.take("b"));
  }
  // Both have half of them. A third is before both.
  EXPECT_FALSE(shared.take("a"));
  EXPECT_FALSE(shared.take("b"));
  EXPECT_FALSE(shared.take("c"));
  shared.giveBack("b");
  EXPECT_FALSE(shared.take("b"));
  EXPECT_TRUE(shared.take("c"));
}

TEST(FairPlaces, AreForTheFirstOfThoseThatHaveEquallyMany) {
  Shared shared(1);
  EXPECT_TRUE(shared.take("a"));
  EXPECT_FALSE(shared.take("b"));
  EXPECT_FALSE(shared.take("c"));
  EXPECT_FALSE(shared.take("b"));
  shared.giveBack("a");
  EXPECT_FALSE(shared.take("c"));
  EXPECT_FALSE(shared.take("a"));
  EXPECT_TRUE(shared.take("b"));
  shared.giveBack("b");
  EXPECT_FALSE(shared.take("b"));
  EXPECT_TRUE(shared.take("c"));
}

TEST(FairPlaces, AreNotKeptForAClientThatDoesNotAskAgain) {
  Shared shared(1);
  EXPECT_TRUE(shared.take("a"));
  EXPECT_FALSE(shared.take("b"));
  shared.giveBack("a");
  shared.clock.advance(FairPlaces::kWaiting);
  EXPECT_FALSE(shared.take("a"));
  shared.clock.advance(1ms);
  EXPECT_TRUE(shared.take("a"));
}

TEST(FairPlaces, OfWhichAClientHasMoreThanHalfAreTooManyOnceAnotherWaits) {
  Shared shared(4);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(shared.take("a"));
  EXPECT_EQ(shared.places.hasTooMany("b"), std::nullopt);  // it does not wait
  EXPECT_TRUE(shared.take("b"));
  EXPECT_FALSE(shared.take("b"));
  EXPECT_EQ(shared.places.hasTooMany("b"), "a");
  EXPECT_EQ(shared.places.hasTooMany("a"), std::nullopt);
  shared.giveBack("a");
  EXPECT_EQ(shared.places.hasTooMany("b"), std::nullopt);
  // A single place is never too many.
  Shared single(1);
  EXPECT_TRUE(single.take("a"));
  EXPECT_FALSE(single.take("b"));
  EXPECT_EQ(single.places.hasTooMany("b"), std::nullopt);
}

TEST(FairPlaces, MayBeGivenBackAfterTheirOwnerHasEnded) {
  FairPlaces::Place place;
  {
    testing::FakeClock clock;
    FairPlaces places(1, clock.now());
    place = places.take("a");
  }
  EXPECT_NE(place, nullptr);
  place.reset();
}

}  // namespace
}  // namespace scolopax::server
