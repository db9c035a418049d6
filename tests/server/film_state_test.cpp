// SPDX-License-Identifier: Apache-2.0
#include "server/film_state.h"

#include <gtest/gtest.h>

#include <utility>

#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;

const RenderPolicy kPolicy;

/// A film of revision 1 that was begun while edits arrived, and its render request.
struct Edited {
  FilmState film;
  RenderRequest request;
  Edited() {
    request.scene = film.scene = std::make_shared<const ResolvedScene>();
    request.revision = film.revision = 1;
    request.wanted = request.interactive = film.begunInteractive = true;
  }
};

TEST(FilmState, IsStaleForAnotherRevisionAndWhenAFinerPictureIsDue) {
  Edited e;
  EXPECT_FALSE(e.film.stale(e.request));
  e.request.revision = 2;
  EXPECT_TRUE(e.film.stale(e.request));
  e.request.revision = 1;
  e.request.interactive = false;
  EXPECT_FALSE(e.film.stale(e.request));  // it has full size
  const auto automatic = std::make_shared<ResolvedScene>();
  automatic->render.method = Method::automatic;
  const auto scene = std::exchange(e.film.scene, automatic);
  EXPECT_TRUE(e.film.stale(e.request));  // drawn with the step of edits, not with what auto chooses
  e.film.scene = scene;
  e.film.divisor = 2;
  EXPECT_TRUE(e.film.stale(e.request));
  e.film.begunInteractive = false;
  EXPECT_FALSE(e.film.stale(e.request));  // an intermediate size, which is shown first
  e.film.restShown = true;
  EXPECT_TRUE(e.film.stale(e.request));
  e.film = {};
  EXPECT_TRUE(e.film.stale(e.request));  // there is no film
}

TEST(FilmState, KeepsThePassOfASmallPictureForAsLongAsItsShield) {
  Edited e;
  const TimePoint begin{1000s};
  e.film.unfinished = true;
  e.film.passBegan = begin;
  e.request.revision = 2;
  EXPECT_TRUE(e.film.shieldsPass(e.request, kPolicy, begin + kPolicy.shield - 1us));
  EXPECT_FALSE(e.film.shieldsPass(e.request, kPolicy, begin + kPolicy.shield));
  e.film.shown.revision = 1;  // the pass would only refine the picture on screen
  EXPECT_FALSE(e.film.shieldsPass(e.request, kPolicy, begin));
}

TEST(FilmState, IsLateOnceThePassOfAnEditHasTakenTooLong) {
  Edited e;
  e.film.unfinished = true;
  e.film.passSeconds = 0.074;
  EXPECT_FALSE(e.film.lateForEdit(e.request, kPolicy));
  e.film.passSeconds = 0.076;
  EXPECT_TRUE(e.film.lateForEdit(e.request, kPolicy));
  e.film.divisor = kMaxDivisor;
  EXPECT_FALSE(e.film.lateForEdit(e.request, kPolicy));
  e.film.divisor = 1;
  e.film.shown.revision = 1;
  EXPECT_FALSE(e.film.lateForEdit(e.request, kPolicy));
}

TEST(FilmState, IsShownAtPowersOfTwoAndAfterTheInterval) {
  Edited e;
  const TimePoint then{1000s};
  e.film.shown.revision = 1;
  e.film.shown.interactive = true;
  e.film.shown.samples = 4;
  e.film.shownAt = then;
  const auto due = [&](std::uint32_t samples, std::chrono::milliseconds after) {
    return e.film.showDue(e.request, {samples, false}, kPolicy, then + after);
  };
  EXPECT_FALSE(due(0, 1s));
  EXPECT_FALSE(due(4, 1s));
  EXPECT_FALSE(due(5, 32ms));
  EXPECT_TRUE(due(5, 33ms));
  EXPECT_TRUE(due(8, 0ms));
  e.request.interactive = e.film.shown.interactive = false;
  EXPECT_FALSE(due(5, 499ms));
  EXPECT_TRUE(due(5, 500ms));
  e.request.pollSamples = {5};
  EXPECT_TRUE(due(5, 0ms));
}

TEST(FilmState, IsShownAgainOnceItsPictureHasBeenDropped) {
  Edited e;
  e.request.interactive = false;
  e.film.shown.revision = 1;
  e.film.shown.samples = 64;
  e.film.shown.final = true;
  const auto due = [&](std::uint32_t samples) {
    return e.film.showDue(e.request, {samples, samples == 64}, kPolicy, TimePoint(1000s));
  };
  EXPECT_FALSE(due(64));
  e.request.drops = 1;
  EXPECT_TRUE(due(64));
  // The film has been dropped, too, and rendered again.
  e.request.pollSamples = {4};
  EXPECT_FALSE(due(3));
  EXPECT_TRUE(due(4));
  e.request.viewed = true;  // a viewer has seen more samples
  EXPECT_FALSE(due(63));
  EXPECT_TRUE(due(64));
  e.film.shownDrops = 1;
  EXPECT_FALSE(due(64));
}

}  // namespace
}  // namespace scolopax::server
