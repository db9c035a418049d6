// SPDX-License-Identifier: Apache-2.0
#include "server/render_loop.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "server/loop_thread.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::FakeViewer;
using testing::seedPatch;
using testing::Workshop;

std::vector<std::uint32_t> samplesOf(const FakeViewer& viewer) {
  std::vector<std::uint32_t> samples;
  for (const auto& frame : viewer.frames) samples.push_back(frame.info.samples);
  return samples;
}

TEST(RenderLoop, ShowsDoublingSampleCountsThenAFrameEveryHalfSecond) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 0.05 / (10 * 10);
  const auto session = workshop.store.create({{"image", {{"width", 10}, {"height", 10}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(40);
  // 50 ms a pass: ten passes are half a second. Powers of two are always shown, and restart that wait.
  EXPECT_EQ(samplesOf(*viewer), (std::vector<std::uint32_t>{1, 2, 4, 8, 16, 26, 32}));
}

TEST(RenderLoop, StopsAtTheSampleCountAndFlagsTheLastFrame) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 3}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(10);
  EXPECT_EQ(samplesOf(*viewer), (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_FALSE(viewer->frames[1].info.final);
  EXPECT_TRUE(viewer->frames[2].info.final);
  // Nothing to do: the only time to wake up is the session's end, which a viewer postpones.
  EXPECT_GE(*workshop.render.step(), workshop.hooks.now() + 300s);
}

TEST(RenderLoop, StopsAtTheEstimatedErrorAndAtTheTime) {
  Workshop workshop;
  workshop.control->error = [](std::uint32_t samples) { return 1.0 / samples; };
  workshop.control->secondsPerPixel = 1.0;
  const auto byError =
      workshop.store.create({{"image", {{"width", 1}, {"height", 1}}}, {"stop", {{"error", 0.05}}}});
  const auto byTime =
      workshop.store.create({{"image", {{"width", 1}, {"height", 1}}}, {"stop", {{"seconds", 7}}}});
  const auto first = std::make_shared<FakeViewer>(), second = std::make_shared<FakeViewer>();
  byError->addViewer(first);
  byTime->addViewer(second);
  workshop.steps(40);
  EXPECT_EQ(first->frames.back().info.samples, 20u);
  EXPECT_TRUE(first->frames.back().info.final);
  EXPECT_EQ(second->frames.back().info.samples, 7u);
  EXPECT_TRUE(second->frames.back().info.final);
}

TEST(RenderLoop, GoesOnWithTheFilmWhenOnlyTheStopRuleChanges) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 2}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(4);
  session->patch({{"stop", {{"samples", 4}}}}, {});
  workshop.steps(6);
  EXPECT_EQ(viewer->frames.back().info.samples, 4u);
  EXPECT_TRUE(viewer->frames.back().info.final);
  EXPECT_EQ(workshop.control->passes.size(), 4u);
}

TEST(RenderLoop, GoesOnWithAWholeFilmAfterEditsThatLeaveItAsItIsHoweverLongAPassTakes) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-4;  // 12 s a pass
  const auto session =
      workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}, {"stop", {{"samples", 2}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(4);
  ASSERT_EQ(samplesOf(*viewer), (std::vector<std::uint32_t>{1, 2}));
  std::uint32_t revision = 1;
  for (const json& patch : {json{{"channels", {{"0", {{"name", "nucleus"}}}}}},
                            json{{"image", {{"background", "#ff8000"}}}}, json{{"stop", {{"samples", 4}}}}}) {
    session->patch(patch, {});
    ++revision;
    workshop.steps(4);
    EXPECT_EQ(viewer->frames.back().info.revision, revision);
    EXPECT_EQ(viewer->frames.back().info.samples, revision < 4 ? 2u : 4u);
    EXPECT_TRUE(viewer->frames.back().info.final);
  }
  for (const auto& frame : viewer->frames) {
    EXPECT_EQ(frame.height, 300);
    EXPECT_FALSE(frame.info.interactive);
  }
  EXPECT_EQ(workshop.control->passes.size(), 4u);
}

TEST(RenderLoop, ConfirmsAnEditThatChangesNothing) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 2}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  const ViewerId id = session->addViewer(viewer);
  workshop.steps(4);
  session->patch(seedPatch(0), {id, 3, {}});
  workshop.steps(2);
  EXPECT_EQ(viewer->frames.back().patch, 3u);
  EXPECT_EQ(viewer->frames.back().info.revision, 2u);
  EXPECT_EQ(viewer->frames.back().info.samples, 2u);
  EXPECT_EQ(workshop.control->passes.size(), 2u);
}

TEST(RenderLoop, NeverMixesRevisionsInOnePicture) {
  Workshop workshop;
  const auto session = workshop.store.create(seedPatch(1));
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  std::uint32_t seed = 1;
  int pass = 0;
  workshop.control->duringPass = [&] {
    if (++pass % 3 == 0) session->patch(seedPatch(++seed), {});
  };
  for (int i = 0; i < 60; ++i) {
    workshop.step();
    workshop.clock.advance(std::chrono::milliseconds(i % 7 * 60));
  }
  ASSERT_GT(viewer->frames.size(), 10u);
  for (const auto& frame : viewer->frames)
    EXPECT_EQ(frame.red, float(frame.info.revision)) << frame.info.number;
}

TEST(RenderLoop, KeepsTheFilmOfACancelledPass) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(2);
  // The edit interrupts the pass; undoing it within the pass restores the film's scene.
  workshop.control->duringPass = [&] {
    workshop.control->duringPass = nullptr;
    session->patch(seedPatch(5), {});
    session->patch(seedPatch(0), {});
  };
  workshop.step();
  EXPECT_EQ(workshop.control->passes.size(), 2u);
  workshop.step();
  EXPECT_EQ(viewer->frames.back().info.samples, 3u);
  EXPECT_EQ(viewer->frames.back().info.revision, 3u);
}

TEST(RenderLoop, GivesOthersTheirTurnWhileAPassIsTooLongForOneSlice) {
  Workshop workshop;
  const auto slow = workshop.store.create(json::object());
  const auto slowViewer = std::make_shared<FakeViewer>();
  slow->addViewer(slowViewer);
  workshop.control->incompletePasses = 3;  // of the first session, the only one so far
  workshop.steps(3);
  EXPECT_TRUE(slowViewer->frames.empty());
  const auto other = workshop.store.create(json::object());
  const auto otherViewer = std::make_shared<FakeViewer>();
  other->addViewer(otherViewer);
  workshop.steps(2);
  EXPECT_FALSE(slowViewer->frames.empty());  // its pass continued where it had stopped
  EXPECT_FALSE(otherViewer->frames.empty());
}

TEST(RenderLoop, ShowsPicturesHoweverFastEditsCome) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-6;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  std::uint32_t seed = 0;
  workshop.control->duringPass = [&] { session->patch(seedPatch(++seed), {}); };
  workshop.steps(20);
  EXPECT_GE(viewer->frames.size(), 18u);
}

TEST(RenderLoop, RendersSmallWhileEditsArriveAndWholeWhenTheyStop) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-6;  // a pass of 400 x 300 takes 120 ms, five times the target
  const auto session =
      workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}, {"stop", {{"samples", 50}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  ASSERT_EQ(viewer->frames.size(), 1u);
  EXPECT_EQ(viewer->frames[0].width, 400);
  EXPECT_FALSE(viewer->frames[0].info.interactive);
  session->patch(seedPatch(1), {});
  workshop.step();
  ASSERT_EQ(viewer->frames.size(), 2u);
  EXPECT_EQ(viewer->frames[1].width, 160);
  EXPECT_EQ(viewer->frames[1].height, 120);
  EXPECT_TRUE(viewer->frames[1].info.interactive);
  EXPECT_FALSE(viewer->frames[1].info.final);
  workshop.clock.advance(Session::kInteractiveTime);
  workshop.step();
  ASSERT_EQ(viewer->frames.size(), 3u);
  EXPECT_EQ(viewer->frames[2].width, 400);
  EXPECT_EQ(viewer->frames[2].info.samples, 1u);
  EXPECT_FALSE(viewer->frames[2].info.interactive);
}

TEST(RenderLoop, GetsFromSmallToWholeInStepsWhereAPassTakesLong) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-4;  // 12 s for the whole picture
  const auto session = workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.step();
  EXPECT_EQ(viewer->frames.back().height, 19);  // 49 ms: smaller pictures are not requested
  workshop.clock.advance(Session::kInteractiveTime);
  viewer->frames.clear();
  workshop.steps(4);
  ASSERT_EQ(viewer->frames.size(), 4u);
  EXPECT_EQ(viewer->frames[0].height, 38);   // within 0.3 s
  EXPECT_EQ(viewer->frames[1].height, 150);  // within 3.6 s
  EXPECT_EQ(viewer->frames[2].height, 300);
  EXPECT_EQ(viewer->frames[3].height, 300);
  for (const int i : {0, 1, 2, 3}) EXPECT_EQ(viewer->frames[std::size_t(i)].info.interactive, i < 2);
  EXPECT_EQ(viewer->frames[3].info.samples, 2u);
  EXPECT_EQ(session->waitForFrame({}, 0ms)->height, 300);
}

TEST(RenderLoop, GetsFromSmallToWholeNoLaterForEditsThatLeaveTheFilmAsItIs) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-4;
  const auto session = workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.step();
  workshop.clock.advance(Session::kInteractiveTime);
  std::vector<int> heights;
  for (const char* name : {"a", "b", "c"}) {
    workshop.step();
    heights.push_back(viewer->frames.back().height);
    session->patch({{"channels", {{"0", {{"name", name}}}}}}, {});
  }
  EXPECT_EQ(heights, (std::vector<int>{38, 150, 300}));
}

TEST(RenderLoop, MixesTheSmallPictureIntoTheNoisyWholeOneInTheProportionOfLeastError) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-6;
  workshop.control->error = [](std::uint32_t) { return 1.5; };
  const auto session =
      workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}, {"stop", {{"samples", 9}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.steps(8);
  // Green is the number of samples. It is the only difference between two pictures, so the mean squared
  // difference over r, g, b and alpha is a quarter of its square.
  const auto green = [&] { return double(session->latestFrame()->image->pixels[0].g); };
  ASSERT_EQ(viewer->frames.back().info.samples, 8u);
  ASSERT_TRUE(viewer->frames.back().info.interactive);
  workshop.clock.advance(Session::kInteractiveTime);
  workshop.step();
  EXPECT_EQ(viewer->frames.back().width, 400);
  EXPECT_DOUBLE_EQ(green(), 8);  // one sample has an error of 1.5 sqrt(8), more than the difference
  workshop.step();
  const double share = 1 - 1.5 * 1.5 / (6 * 6 / 4.0);
  EXPECT_NEAR(green(), 8 * (1 - share) + 2 * share, 1e-5);
  EXPECT_FALSE(viewer->frames.back().info.interactive);
  EXPECT_EQ(session->waitForFrame({}, 0ms), nullptr);  // a script gets only unmixed samples
  workshop.steps(8);
  ASSERT_TRUE(viewer->frames.back().info.final);
  EXPECT_DOUBLE_EQ(green(), 9);  // the final picture is unmixed, too
  EXPECT_NE(session->waitForFrame({}, 0ms), nullptr);
}

TEST(RenderLoop, MixesNothingIntoAPictureWhoseErrorIsNotKnown) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-6;
  workshop.control->error = [](std::uint32_t) { return std::numeric_limits<double>::quiet_NaN(); };
  const auto session =
      workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}, {"stop", {{"samples", 9}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.steps(8);
  ASSERT_EQ(viewer->frames.back().info.samples, 8u);
  ASSERT_TRUE(viewer->frames.back().info.interactive);
  workshop.clock.advance(Session::kInteractiveTime);
  for (const double samples : {1.0, 2.0}) {
    workshop.step();
    EXPECT_EQ(viewer->frames.back().width, 400);
    EXPECT_EQ(double(session->latestFrame()->image->pixels[0].g), samples);
  }
}

TEST(RenderLoop, BeginsThePictureOfAnEditAnewCoarserWhenItTakesTooLong) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-7;
  const auto session = workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.control->incompletePasses = 1;  // 75 ms are used up
  workshop.steps(2);
  EXPECT_EQ(viewer->frames.back().height, 120);
  EXPECT_EQ(viewer->frames.back().info.revision, 2u);
  EXPECT_TRUE(viewer->frames.back().info.interactive);
}

TEST(RenderLoop, BeginsSmallWhenTheFirstPassWasCancelled) {
  Workshop workshop;
  const auto session = workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.control->duringPass = [&] {
    workshop.control->duringPass = nullptr;
    session->patch(seedPatch(1), {});
  };
  workshop.steps(2);
  ASSERT_EQ(viewer->frames.size(), 1u);
  EXPECT_EQ(viewer->frames[0].width, 100);
}

TEST(RenderLoop, SleepsUntilQualityIsDueWhenTheSmallPictureIsDone) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 2}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.steps(2);
  const auto next = workshop.render.step();
  ASSERT_TRUE(next);
  EXPECT_EQ(*next, workshop.hooks.now() + Session::kInteractiveTime);
  workshop.clock.advance(Session::kInteractiveTime);
  workshop.step();
  EXPECT_TRUE(viewer->frames.back().info.final);
  EXPECT_FALSE(viewer->frames.back().info.interactive);
  EXPECT_EQ(workshop.control->passes.size(), 3u);  // it had full size already: the film continues
}

TEST(RenderLoop, SharesTheTimeForAPassBetweenTheSessionsThatAreEdited) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-6;  // 90 ms a pass
  std::vector<std::shared_ptr<Session>> sessions;
  std::vector<std::shared_ptr<FakeViewer>> viewers;
  for (int i = 0; i < 4; ++i) {
    sessions.push_back(workshop.store.create({{"image", {{"width", 300}, {"height", 300}}}}));
    viewers.push_back(std::make_shared<FakeViewer>());
    sessions.back()->addViewer(viewers.back());
  }
  workshop.steps(8);
  sessions[0]->patch(seedPatch(1), {});
  workshop.step();
  EXPECT_EQ(viewers[0]->frames.back().width, 150);  // 22.5 ms, alone
  workshop.clock.advance(Session::kInteractiveTime);
  for (const auto& session : sessions) session->patch(seedPatch(2), {});
  workshop.step();
  EXPECT_EQ(viewers[1]->frames.back().width, 100);  // 10 ms: one of four sessions, which share 50 ms
}

/// The time that each turn gets when none suffices and `edited` sessions have been edited, over three rounds.
std::vector<std::chrono::nanoseconds> turnsOfSlowPasses(int edited) {
  Workshop workshop;
  std::vector<std::shared_ptr<Session>> sessions;
  for (int i = 0; i < edited; ++i) {
    sessions.push_back(workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}}));
    sessions.back()->addViewer(std::make_shared<FakeViewer>());
  }
  workshop.steps(2 * edited);
  for (const auto& session : sessions) session->patch(seedPatch(1), {});
  workshop.control->incompletePasses = 3 * edited;
  workshop.control->budgets.clear();
  workshop.steps(3 * edited);
  return workshop.control->budgets;
}

TEST(RenderLoop, GivesAnEditsPictureOnlyItsShareOfTheTimeWhileOtherSessionsAreEdited) {
  using Times = std::vector<std::chrono::nanoseconds>;
  EXPECT_EQ(turnsOfSlowPasses(1), (Times{75ms, 75ms, 75ms}));  // each begins coarser
  EXPECT_EQ(turnsOfSlowPasses(2), (Times{37500us, 37500us, 8ms, 8ms, 8ms, 8ms}));
  EXPECT_EQ(turnsOfSlowPasses(3), (Times{24999us, 24999us, 24999us, 8ms, 8ms, 8ms, 8ms, 8ms, 8ms}));
}

TEST(RenderLoop, BeginsThePictureOfAnEditAnewCoarserWhenItsShortTurnsTakeTooLong) {
  Workshop workshop;
  const json scene = {{"image", {{"width", 400}, {"height", 300}}}};
  const auto slow = workshop.store.create(scene);
  slow->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(2);
  const auto other = workshop.store.create(scene);
  other->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(2);
  for (const auto& session : {slow, other}) session->patch(seedPatch(1), {});
  const int turns = 1 + 5;  // of 37.5 and 8 ms: more than 75
  workshop.control->incompletePasses = 2 * turns;
  workshop.steps(2 * turns + 1);
  EXPECT_EQ(workshop.control->sizes.back(), std::pair(160, 120));
  EXPECT_EQ(workshop.control->budgets.back(), 8ms);  // it has taken too much before
}

TEST(RenderLoop, ShowsTheSmallPictureOfAnEditHoweverLateItIs) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-6;
  const auto session = workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.control->incompletePasses = 1;
  workshop.step();
  workshop.clock.advance(Session::kInteractiveTime);
  workshop.step();
  EXPECT_LT(viewer->frames.back().width, 400);
  EXPECT_EQ(viewer->frames.back().info.revision, 2u);
  workshop.step();
  EXPECT_EQ(viewer->frames.back().width, 400);
}

TEST(RenderLoop, LetsSessionsTakeTurns) {
  Workshop workshop;
  std::vector<std::shared_ptr<FakeViewer>> viewers;
  for (std::uint32_t i = 1; i <= 3; ++i) {
    viewers.push_back(std::make_shared<FakeViewer>());
    workshop.store.create(seedPatch(i))->addViewer(viewers.back());
  }
  workshop.steps(30);
  std::map<std::uint32_t, int> turns;
  for (const std::uint32_t seed : workshop.control->passes) ++turns[seed];
  EXPECT_EQ(turns, (std::map<std::uint32_t, int>{{1, 10}, {2, 10}, {3, 10}}));
}

TEST(RenderLoop, GivesTheFirstPictureAfterAnEditItsTurnBeforeAllOthers) {
  Workshop workshop;
  std::vector<std::shared_ptr<Session>> sessions;
  for (std::uint32_t i = 1; i <= 5; ++i) {
    sessions.push_back(workshop.store.create(seedPatch(i)));
    sessions.back()->addViewer(std::make_shared<FakeViewer>());
  }
  workshop.steps(10);
  for (int i = 0; i < 5; ++i) {
    const auto seed = std::uint32_t(100 + i);
    sessions[std::size_t(i)]->patch(seedPatch(seed), {});
    workshop.step();
    EXPECT_EQ(workshop.control->passes.back(), seed);
    workshop.clock.advance(Session::kInteractiveTime);
    workshop.step();  // another session's turn
  }
}

TEST(RenderLoop, InterruptsAPassAtRestForAnEditOfAnotherSessionAndGoesOnWithItAfterwards) {
  Workshop workshop;
  const auto calm = workshop.store.create(seedPatch(1000));
  const auto calmViewer = std::make_shared<FakeViewer>(), busyViewer = std::make_shared<FakeViewer>();
  calm->addViewer(calmViewer);
  workshop.steps(2);
  const auto busy = workshop.store.create(seedPatch(1));
  busy->addViewer(busyViewer);
  workshop.control->duringPass = [&] {
    workshop.control->duringPass = nullptr;
    busy->patch(seedPatch(2), {});
  };
  workshop.step();
  EXPECT_EQ(workshop.control->passes.size(), 2u);  // interrupted
  workshop.step();
  EXPECT_EQ(workshop.control->passes.back(), 2u);
  EXPECT_TRUE(busyViewer->frames.back().info.interactive);
  workshop.step();
  EXPECT_EQ(workshop.control->passes.back(), 1000u);
  EXPECT_EQ(calmViewer->frames.back().info.revision, 1u);
}

TEST(RenderLoop, LetsTheFirstPictureAfterAnEditEndAndInterruptsWhatOnlyRefinesIt) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.control->duringPass = [&] {
    workshop.control->duringPass = nullptr;
    session->patch(seedPatch(2), {});
  };
  workshop.step();
  EXPECT_EQ(workshop.control->passes, (std::vector<std::uint32_t>{0, 1}));
  workshop.step();
  EXPECT_EQ(workshop.control->passes, (std::vector<std::uint32_t>{0, 1, 2}));
  workshop.control->duringPass = [&] {
    workshop.control->duringPass = nullptr;
    session->patch(seedPatch(3), {});
  };
  workshop.steps(2);  // the second sample of seed 2 is not completed
  EXPECT_EQ(workshop.control->passes, (std::vector<std::uint32_t>{0, 1, 2, 3}));
}

TEST(RenderLoop, LetsAnEditedSessionStarveNobody) {
  Workshop workshop;
  const auto busy = workshop.store.create(seedPatch(1));
  const auto calm = workshop.store.create(seedPatch(1000));
  busy->addViewer(std::make_shared<FakeViewer>());
  calm->addViewer(std::make_shared<FakeViewer>());
  std::uint32_t seed = 1;
  workshop.control->duringPass = [&] { busy->patch(seedPatch(++seed), {}); };
  workshop.steps(40);
  // The first edit interrupts the first turn; from then on every second turn is the other session's.
  EXPECT_EQ(std::count(workshop.control->passes.begin(), workshop.control->passes.end(), 1000u), 19);
}

TEST(RenderLoop, MakesAnotherRendererForAnotherDataset) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(2);
  session->patch(seedPatch(3), {});
  workshop.steps(2);
  EXPECT_EQ(workshop.control->renderersMade, 1);
  session->patch({{"dataset", "other"}}, {});
  workshop.steps(2);
  EXPECT_EQ(workshop.control->renderersMade, 2);
}

TEST(RenderLoop, TakesAlmostForeverNoResourcesOfADeletedSession) {
  Workshop workshop;
  const auto viewer = std::make_shared<FakeViewer>();
  std::weak_ptr<Session> session = workshop.store.create(json::object());
  session.lock()->addViewer(viewer);
  workshop.steps(2);
  EXPECT_TRUE(workshop.store.remove(session.lock()->id()));
  workshop.step();
  EXPECT_TRUE(session.expired());
  EXPECT_FALSE(viewer->closed.empty());
}

TEST(LoopThread, RunsOncePerWakeAndNotBetween) {
  LoopThread loop;
  std::mutex mutex;
  std::condition_variable changed;
  int steps = 0;
  loop.start([&]() -> std::optional<TimePoint> {
    const std::lock_guard lock(mutex);
    ++steps;
    changed.notify_all();
    return std::nullopt;
  });
  const auto waitFor = [&](int count) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, 60s, [&] { return steps == count; });
  };
  EXPECT_TRUE(waitFor(1));
  loop.wake();
  EXPECT_TRUE(waitFor(2));
  loop.stop();
  EXPECT_EQ(steps, 2);
}

}  // namespace
}  // namespace scolopax::server
