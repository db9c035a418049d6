// SPDX-License-Identifier: Apache-2.0
// Background work of the render loop: building scenes, accumulating and encoding large pictures, and
// measuring errors that take long.
#include "server/render_loop.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::FakeViewer;
using testing::seedPatch;
using testing::Workshop;

TEST(RenderLoop, RefusesAFilmThatTheMemoryForAllSessionsDoesNotHoldUntilItIsAskedForAgain) {
  Workshop workshop;
  workshop.control->memory = std::make_shared<MemoryBudget>(4 * 64 * 48 + 10);
  const json large = {{"image", {{"width", 64}, {"height", 48}}}};
  std::vector<std::shared_ptr<Session>> sessions;
  std::vector<std::shared_ptr<FakeViewer>> viewers;
  for (int i = 0; i < 5; ++i) {
    sessions.push_back(workshop.store.create(large));
    viewers.push_back(std::make_shared<FakeViewer>());
    sessions.back()->addViewer(viewers.back());
  }
  workshop.steps(10);
  int failed = 0;
  for (const auto& viewer : viewers) failed += !viewer->failures.empty();
  EXPECT_EQ(failed, 1);
  ASSERT_FALSE(viewers[4]->failures.empty());
  EXPECT_TRUE(workshop.store.remove(sessions[0]->id()));
  EXPECT_EQ(sessions[4]->waitForFrame({}, 0ms), nullptr);
  workshop.clock.advance(std::chrono::seconds(1));
  workshop.steps(20);
  EXPECT_FALSE(viewers[4]->frames.empty());
}

TEST(RenderLoop, DropsTheFilmThatNobodyHasWatchedForTheLongestTimeWhenMemoryIsShort) {
  Workshop workshop({32, 5min}, std::make_shared<MemoryBudget>(11'000'000));  // three films and the pictures
  workshop.control->filmPixelBytes = 1000;
  struct Watched {
    std::shared_ptr<Session> session;
    std::shared_ptr<FakeViewer> viewer = std::make_shared<FakeViewer>();
    ViewerId id = 0;
  };
  std::vector<Watched> all(4);
  const auto watch = [&](std::size_t i) {
    Watched& one = all[i];
    one.id = one.session->addViewer(one.viewer);
    workshop.steps(3);
    EXPECT_TRUE(one.viewer->failures.empty()) << i;
  };
  const auto leave = [&](std::size_t i) {
    all[i].session->removeViewer(all[i].id);
    workshop.steps(3);
  };
  for (Watched& one : all)
    one.session =
        workshop.store.create({{"image", {{"width", 64}, {"height", 48}}}, {"stop", {{"samples", 2}}}});
  for (const std::size_t i : {0, 1, 2}) watch(i);
  leave(1);
  leave(0);
  EXPECT_EQ(workshop.control->renderersMade, 3);
  watch(3);  // instead of 1
  watch(0);  // still there
  EXPECT_EQ(workshop.control->renderersMade, 4);
  leave(2);
  watch(1);  // instead of 2
  EXPECT_EQ(workshop.control->renderersMade, 5);
  for (const Watched& one : all) {
    // No picture is worse than one shown before.
    std::vector<std::uint32_t> samples;
    for (const auto& frame : one.viewer->frames) samples.push_back(frame.info.samples);
    EXPECT_TRUE(std::is_sorted(samples.begin(), samples.end()));
    EXPECT_TRUE(one.viewer->frames.back().info.final);
  }
  // An edit shows that the film is there again.
  all[1].session->patch(seedPatch(7), {});
  workshop.steps(3);
  EXPECT_EQ(all[1].viewer->frames.back().red, 7);
}

TEST(RenderLoop, GivesThePictureOfARequestTheMemoryOfAFilmThatNobodyWatches) {
  const auto memory = std::make_shared<MemoryBudget>(3'500'000);
  Workshop workshop({32, 5min}, memory);
  workshop.control->filmPixelBytes = 1000;
  const auto session = workshop.store.create({{"image", {{"width", 64}, {"height", 48}}}});
  const ViewerId id = session->addViewer(std::make_shared<FakeViewer>());
  workshop.render.step();
  EXPECT_EQ(memory->used(MemoryUse::films), 64 * 48 * 1000u);
  EXPECT_THROW(MemoryBudget::take(memory, MemoryUse::encodings, 1'000'000), Error);
  session->removeViewer(id);
  workshop.render.step();
  EXPECT_NO_THROW(MemoryBudget::take(memory, MemoryUse::encodings, 1'000'000));
  EXPECT_EQ(memory->used(MemoryUse::films), 0u);
}

TEST(RenderLoop, DropsPicturesThatNobodyWatchesBeforeItRefusesAnother) {
  const auto memory = std::make_shared<MemoryBudget>(200'000);  // three pictures, and all films
  Workshop workshop({32, 5min}, memory);
  std::vector<std::shared_ptr<Session>> sessions;
  std::vector<std::uint32_t> numbers;
  for (int i = 0; i < 6; ++i) {
    sessions.push_back(
        workshop.store.create({{"image", {{"width", 64}, {"height", 48}}}, {"stop", {{"samples", 2}}}}));
    const auto viewer = std::make_shared<FakeViewer>();
    const ViewerId id = sessions.back()->addViewer(viewer);
    workshop.steps(4);
    EXPECT_TRUE(viewer->failures.empty()) << i;
    ASSERT_FALSE(viewer->frames.empty()) << i;
    EXPECT_TRUE(viewer->frames.back().info.final) << i;
    numbers.push_back(viewer->frames.back().info.number);
    sessions.back()->removeViewer(id);
    workshop.clock.advance(1s);
    workshop.step();
  }
  EXPECT_EQ(workshop.control->renderersMade, 6);
  EXPECT_EQ(memory->used(MemoryUse::films), 6 * 64 * 48u);
  EXPECT_NE(sessions[5]->latestFrame()->image, nullptr);
  // Those that have been unused for longest went first. Their JPEGs are still there.
  EXPECT_EQ(sessions[0]->latestFrame()->image, nullptr);
  EXPECT_NE(sessions[0]->waitForFrame({}, 0ms), nullptr);
  EXPECT_EQ(sessions[0]->waitForFrame({.image = true}, 0ms), nullptr);
  // Whoever wants the picture gets it again, from the film and as the same frame.
  const auto viewer = std::make_shared<FakeViewer>();
  sessions[0]->addViewer(viewer);
  workshop.steps(3);
  const auto again = sessions[0]->waitForFrame({.image = true}, 0ms);
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->info.number, numbers[0]);
  EXPECT_EQ(viewer->frames.size(), 1u);
  EXPECT_EQ(workshop.control->passes.size(), 12u);
  EXPECT_EQ(workshop.control->renderersMade, 6);
}

TEST(RenderLoop, DropsNoPictureThatAViewerSees) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 1}}}});
  EXPECT_FALSE(session->dropPicture());
  const ViewerId id = session->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(2);
  EXPECT_FALSE(session->dropPicture());
  session->setView(id, false, 0);
  EXPECT_TRUE(session->dropPicture());
  EXPECT_FALSE(session->dropPicture());
  EXPECT_EQ(session->latestFrame()->image, nullptr);
}

TEST(RenderLoop, TriesAgainAfterASecondWhatOthersMemoryKeptItFrom) {
  Workshop workshop;
  workshop.control->memory = std::make_shared<MemoryBudget>(64 * 48);
  auto others = MemoryBudget::take(workshop.control->memory, MemoryUse::grids, 64 * 48);
  const auto session = workshop.store.create({{"image", {{"width", 64}, {"height", 48}}}});
  const auto viewer = std::make_shared<FakeViewer>(), second = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(3);
  EXPECT_EQ(viewer->failures.size(), 1u);
  EXPECT_EQ(workshop.render.step(), workshop.hooks.now() + Session::kRetryTime);
  workshop.clock.advance(Session::kRetryTime);
  workshop.steps(3);
  EXPECT_EQ(workshop.control->renderersMade, 2);
  EXPECT_EQ(viewer->failures.size(), 1u);  // an unsuccessful retry is not reported again
  session->addViewer(second);
  workshop.steps(3);
  EXPECT_EQ(second->failures.size(), 1u);
  others.resize(0);
  session->setView(2, true, 0);
  workshop.steps(3);
  EXPECT_FALSE(viewer->frames.empty());
  EXPECT_FALSE(second->frames.empty());
}

TEST(RenderLoop, ShowsAFinishedPictureAgainThatCouldNotBeEncoded) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 1}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(4);
  const auto before = viewer->frames.size();
  session->fail(1, Error(ErrorCode::busy, "memory for encodings"));
  workshop.steps(4);
  EXPECT_EQ(viewer->frames.size(), before);
  workshop.clock.advance(Session::kRetryTime);
  workshop.steps(4);
  EXPECT_EQ(viewer->frames.size(), before + 1);
}

TEST(RenderLoop, RendersTheSceneThatReplacedOneWhosePictureCouldNotBeMade) {
  Workshop workshop;
  const auto session = workshop.store.create({{"image", {{"width", 1024}, {"height", 1024}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.render.step();
  workshop.background.atOnce = false;
  workshop.control->error = [](std::uint32_t) -> double {
    throw Error(ErrorCode::busy, "memory for pictures");
  };
  workshop.clock.advance(600ms);
  for (int i = 0; i < 4 && viewer->failures.empty(); ++i) {
    // The edit arrives while the picture is being made.
    if (i == 2) session->patch({{"image", {{"width", 64}, {"height", 64}}}}, {});
    workshop.background.finish();
    workshop.render.step();
  }
  workshop.control->error = [](std::uint32_t) { return 1.0; };
  workshop.background.atOnce = true;
  workshop.background.finish();
  EXPECT_FALSE(viewer->failures.empty());
  workshop.steps(4);
  ASSERT_FALSE(viewer->frames.empty());
  EXPECT_EQ(viewer->frames.back().info.revision, 2u);
}

TEST(RenderLoop, BuildsInTheBackgroundWhileOthersHaveTheirTurns) {
  Workshop workshop;
  const auto calm = workshop.store.create(seedPatch(1)), other = workshop.store.create(seedPatch(2));
  const auto calmViewer = std::make_shared<FakeViewer>(), otherViewer = std::make_shared<FakeViewer>();
  calm->addViewer(calmViewer);
  workshop.steps(2);
  workshop.background.atOnce = false;
  other->addViewer(otherViewer);
  workshop.steps(10);
  EXPECT_EQ(workshop.background.waiting.size(), 1u);
  EXPECT_EQ(workshop.control->passes,
            std::vector<std::uint32_t>(11, 1));  // one turn was spent on starting the build
  EXPECT_TRUE(otherViewer->frames.empty());
  const int wakes = workshop.renderWakes;
  workshop.background.finish();
  EXPECT_EQ(workshop.renderWakes, wakes + 1);
  workshop.steps(2);
  EXPECT_FALSE(otherViewer->frames.empty());
}

TEST(RenderLoop, SleepsWhileThereIsNothingButABuild) {
  Workshop workshop;
  workshop.background.atOnce = false;
  const auto session = workshop.store.create(json::object());
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.step();
  EXPECT_GE(*workshop.render.step(), workshop.hooks.now() + 300s);
}

TEST(RenderLoop, EndsTheChoiceOfAMethodForASceneThatIsEdited) {
  Workshop workshop;
  workshop.control->secondsPerPixel = 1e-6;
  const auto session = workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.control->choosingTakesLong = true;
  workshop.step();
  session->patch(seedPatch(1), {});
  workshop.step();
  workshop.background.atOnce = false;
  workshop.clock.advance(Session::kInteractiveTime);
  workshop.step();
  ASSERT_EQ(workshop.background.waiting.size(), 1u);
  session->patch(seedPatch(2), {});
  workshop.step();
  bool stopped = false;
  workshop.control->building = [&](const std::stop_token& stop) { stopped = stop.stop_requested(); };
  workshop.background.finish();
  EXPECT_TRUE(stopped);
  workshop.control->building = nullptr;
  workshop.step();
  EXPECT_EQ(viewer->frames.back().red, 2);
}

TEST(RenderLoop, GivesUpABuildThatNobodyWaitsForAnyMore) {
  Workshop workshop;
  workshop.background.atOnce = false;
  bool stopped = false;
  workshop.control->building = [&](const std::stop_token& stop) { stopped = stop.stop_requested(); };
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  const ViewerId id = session->addViewer(viewer);
  workshop.step();
  session->removeViewer(id);
  workshop.step();
  workshop.background.finish();
  EXPECT_TRUE(stopped);
  workshop.step();
  EXPECT_TRUE(workshop.last.abandoned);
  EXPECT_TRUE(viewer->failures.empty());
  // The next viewer starts the build again.
  workshop.background.atOnce = true;
  session->addViewer(viewer);
  workshop.steps(2);
  EXPECT_FALSE(viewer->frames.empty());
}

TEST(RenderLoop, GivesUpABuildForAnEditThatNeedsAnotherAndGoesOnForOneThatDoesNot) {
  for (const bool needsAnother : {false, true}) {
    Workshop workshop;
    workshop.background.atOnce = false;
    bool stopped = false;
    workshop.control->building = [&](const std::stop_token& stop) {
      stopped = stopped || stop.stop_requested();
    };
    const auto session = workshop.store.create(json::object());
    const auto viewer = std::make_shared<FakeViewer>();
    session->addViewer(viewer);
    workshop.step();
    session->patch(needsAnother ? json{{"integrator", {{"macrocell", 2}}}} : seedPatch(5), {});
    workshop.step();
    workshop.background.finish();
    EXPECT_EQ(stopped, needsAnother);
    workshop.background.atOnce = true;
    workshop.steps(2);
    ASSERT_FALSE(viewer->frames.empty());
    EXPECT_EQ(viewer->frames.front().info.revision, 2u);
    EXPECT_EQ(workshop.control->renderersMade, needsAnother ? 2 : 1);
  }
}

TEST(RenderLoop, LetsGoOfADeletedSessionWhoseSceneIsBeingBuilt) {
  Workshop workshop;
  workshop.background.atOnce = false;
  std::weak_ptr<Session> session = workshop.store.create(json::object());
  session.lock()->addViewer(std::make_shared<FakeViewer>());
  workshop.step();
  EXPECT_TRUE(workshop.store.remove(session.lock()->id()));
  workshop.step();
  EXPECT_TRUE(session.expired());
  workshop.background.finish();
}

TEST(RenderLoop, AddsUpAndMakesLargePicturesInTheBackground) {
  Workshop workshop;
  const auto large = workshop.store.create({{"image", {{"width", 1024}, {"height", 1024}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  large->addViewer(viewer);
  workshop.steps(2);
  const auto small = workshop.store.create(seedPatch(7));
  const auto smallViewer = std::make_shared<FakeViewer>();
  small->addViewer(smallViewer);
  workshop.steps(4);
  workshop.background.atOnce = false;
  const auto before = viewer->frames.size(), smallBefore = smallViewer->frames.size();
  workshop.steps(8);
  EXPECT_EQ(workshop.background.waiting.size(), 1u);
  EXPECT_EQ(viewer->frames.size(), before);
  EXPECT_GT(smallViewer->frames.size(), smallBefore);
  // A sample is added and its picture encoded before the next pass, which takes long, ends.
  workshop.clock.advance(600ms);
  small->close("");
  workshop.control->incompletePasses = 1000;
  for (int i = 0; i < 3; ++i) {
    workshop.background.finish();
    workshop.step();
  }
  EXPECT_EQ(viewer->frames.size(), before + 1);
}

TEST(RenderLoop, RendersInTheBackgroundWhatCannotBeDividedIntoTurns) {
  // A slice of a tenth of a second takes a whole second: the rays take too long for a turn.
  Workshop workshop;
  const auto slow = workshop.store.create(seedPatch(1)), quick = workshop.store.create(seedPatch(2));
  const auto slowViewer = std::make_shared<FakeViewer>(), quickViewer = std::make_shared<FakeViewer>();
  slow->addViewer(slowViewer);
  const auto takeLong = [&] { workshop.clock.advance(1s); };
  workshop.control->duringPass = takeLong;
  workshop.step();
  ASSERT_EQ(workshop.control->passes, std::vector<std::uint32_t>({1}));
  workshop.passes.atOnce = false;
  workshop.control->duringPass = {};
  workshop.step();
  EXPECT_EQ(workshop.control->passes.size(), 1u);  // waits in the background
  ASSERT_EQ(workshop.passes.waiting.size(), 1u);
  quick->addViewer(quickViewer);
  workshop.steps(4);
  EXPECT_FALSE(quickViewer->frames.empty());
  EXPECT_EQ(workshop.control->passes.back(), 2u);
  workshop.passes.atOnce = true;
  workshop.control->duringPass = takeLong;
  workshop.passes.finish();
  workshop.control->duringPass = {};
  EXPECT_EQ(workshop.control->passes.back(), 1u);
  const auto before = slowViewer->frames.size();
  workshop.steps(6);
  EXPECT_GT(slowViewer->frames.size(), before);
  // After a while without such rays, its passes take turns again.
  workshop.clock.advance(20s);
  workshop.passes.atOnce = false;
  const auto passes = workshop.control->passes.size();
  workshop.steps(4);
  EXPECT_GT(workshop.control->passes.size(), passes);
  EXPECT_TRUE(workshop.passes.waiting.empty());
}

TEST(RenderLoop, RendersTheFirstPassOfASessionInTheBackgroundWhileAnotherIsEdited) {
  Workshop workshop;
  const auto edited = workshop.store.create(seedPatch(1)), other = workshop.store.create(seedPatch(2));
  edited->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(3);
  workshop.passes.atOnce = false;
  edited->patch(seedPatch(3), {});
  other->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(4);
  EXPECT_EQ(workshop.control->passes.back(), 3u);
  ASSERT_EQ(workshop.passes.waiting.size(), 1u);
  workshop.passes.finish();
  EXPECT_EQ(workshop.control->passes.back(), 2u);
  // Its rays were quick, so it takes turns from now on.
  edited->patch(seedPatch(4), {});
  const auto passes = workshop.control->passes.size();
  workshop.steps(4);
  EXPECT_TRUE(workshop.passes.waiting.empty());
  EXPECT_GT(std::count(workshop.control->passes.begin() + std::ptrdiff_t(passes),
                       workshop.control->passes.end(), 2u),
            0);
}

TEST(RenderLoop, EndsAFirstPictureWhoseRaysTakeTooLongAndRendersItInTheBackground) {
  for (const bool tooLong : {false, true}) {
    Workshop workshop;
    const auto session = workshop.store.create({{"image", {{"width", 400}, {"height", 300}}}});
    const auto viewer = std::make_shared<FakeViewer>();
    session->addViewer(viewer);
    workshop.step();
    session->patch(seedPatch(5), {});
    const auto begun = workshop.control->budgets.size(), passes = workshop.control->passes.size();
    workshop.control->duringPass = [&] {
      workshop.control->duringPass = {};
      workshop.clock.advance(75ms + (tooLong ? 300ms : 299ms));
      workshop.render.watch();
    };
    workshop.passes.atOnce = false;
    workshop.step();
    EXPECT_EQ(workshop.control->budgets.size(), begun + 1);
    EXPECT_EQ(workshop.control->passes.size(), passes + !tooLong);
    EXPECT_FALSE(workshop.last.cancelled);
    workshop.step();
    EXPECT_EQ(workshop.passes.waiting.size(), tooLong ? 1u : 0u);
    workshop.passes.finish();
    workshop.step();
    EXPECT_EQ(viewer->frames.back().info.revision, 2u);
  }
}

TEST(RenderLoop, LetsLargePicturesNotWaitForPassesWithSlowRays) {
  Workshop workshop;
  const auto slow = workshop.store.create(seedPatch(1));
  slow->addViewer(std::make_shared<FakeViewer>());
  workshop.control->duringPass = [&] { workshop.clock.advance(1s); };
  workshop.step();
  workshop.control->duringPass = {};
  workshop.passes.atOnce = false;
  workshop.step();
  ASSERT_EQ(workshop.passes.waiting.size(), 1u);
  const auto large = workshop.store.create({{"image", {{"width", 1024}, {"height", 1024}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  large->addViewer(viewer);
  workshop.steps(6);
  EXPECT_FALSE(viewer->frames.empty());
  EXPECT_EQ(workshop.passes.waiting.size(), 1u);
}

TEST(RenderLoop, BeginsToRecordAovsInTheBackground) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(2);
  workshop.background.atOnce = false;
  EXPECT_EQ(session->waitForFrame({.aovs = true}, 0ms), nullptr);
  workshop.steps(3);
  EXPECT_EQ(workshop.background.waiting.size(), 1u);
  workshop.background.finish();
  workshop.steps(3);
  EXPECT_NE(session->latestFrame()->aovs, nullptr);
}

TEST(RenderLoop, EndsRecordingWithAnEditWhenNobodyAsksForAovsAnyMore) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  session->addViewer(std::make_shared<FakeViewer>());
  session->waitForFrame({.aovs = true}, 0ms);
  workshop.steps(3);
  ASSERT_NE(session->latestFrame()->aovs, nullptr);
  const int made = workshop.control->renderersMade;
  workshop.clock.advance(60s);
  session->patch(seedPatch(2), {});
  workshop.steps(3);
  EXPECT_EQ(workshop.control->renderersMade, made + 1);  // the records are those of the renderer
  workshop.clock.advance(10s);
  workshop.steps(6);
  EXPECT_EQ(session->latestFrame()->info.revision, session->scene().revision);
  EXPECT_EQ(session->latestFrame()->aovs, nullptr);
}

TEST(RenderLoop, AddsUpInTheBackgroundWhatIsLargeInBytes) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.step();
  workshop.background.atOnce = false;
  workshop.step();
  EXPECT_TRUE(workshop.background.waiting.empty());
  workshop.control->filmIsLarge = true;
  workshop.step();
  EXPECT_EQ(workshop.background.waiting.size(), 1u);
}

TEST(RenderLoop, EndsAPassInTheBackgroundThatAnEditMakesUseless) {
  Workshop workshop;
  const auto session = workshop.store.create(seedPatch(1));
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.control->duringPass = [&] { workshop.clock.advance(1s); };
  workshop.step();
  workshop.step();
  workshop.passes.atOnce = false;
  workshop.step();
  ASSERT_EQ(workshop.passes.waiting.size(), 1u);
  session->patch(seedPatch(5), {});
  workshop.clock.advance(1s);
  workshop.step();
  const auto passes = workshop.control->passes.size();
  workshop.control->duringPass = {};
  workshop.passes.finish();
  EXPECT_EQ(workshop.control->passes.size(), passes);  // it was cancelled
}

TEST(RenderLoop, EndsEvenUrgentPassesWhenItStops) {
  Workshop workshop;
  const auto session = workshop.store.create(seedPatch(1));
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.step();
  session->patch(seedPatch(5), {});
  workshop.control->duringPass = [&] { workshop.render.stop(); };
  const auto passes = workshop.control->passes.size();
  workshop.steps(2);
  EXPECT_EQ(workshop.control->passes.size(), passes);
}

/// A small picture of 16 samples whose error is being measured until the test lets the background job finish.
struct Measured {
  Workshop workshop;
  std::shared_ptr<FakeViewer> viewer = std::make_shared<FakeViewer>(), other = std::make_shared<FakeViewer>();
  std::shared_ptr<Session> session, otherSession;
  ViewerId viewerId{};
  int measured = 0, stopped = 0;

  Measured() {
    workshop.control->longErrorFrom = 16;
    workshop.control->error = [](std::uint32_t) { return 0.5; };
    workshop.control->measuring = [this](const std::stop_token& stop) {
      ++measured;
      stopped += stop.stop_requested();
    };
    session = workshop.store.create({{"stop", {{"error", 0.9}}}});
    viewerId = session->addViewer(viewer);
    otherSession = workshop.store.create({{"stop", {{"samples", 1}}}});
    otherSession->addViewer(other);
    workshop.steps(4);
    workshop.errors.atOnce = false;
    workshop.steps(30);
  }
};

TEST(RenderLoop, MeasuresAnErrorThatTakesLongInTheBackgroundWhileOthersHaveTheirTurns) {
  Measured test;
  EXPECT_EQ(test.workshop.errors.waiting.size(), 1u);
  EXPECT_TRUE(test.workshop.passes.waiting.empty());  // where others' passes would wait for it
  EXPECT_EQ(test.measured, 0);
  EXPECT_EQ(test.viewer->frames.back().info.samples, 8u);
  test.otherSession->patch(seedPatch(5), {});
  test.workshop.steps(2);
  EXPECT_EQ(test.other->frames.back().info.revision, 2u);
  EXPECT_FALSE(test.viewer->frames.back().info.final);
  test.workshop.errors.finish();
  test.workshop.steps(6);
  EXPECT_EQ(test.measured, 1);
  EXPECT_TRUE(test.viewer->frames.back().info.final);
  EXPECT_EQ(test.viewer->frames.back().info.samples, 16u);
}

TEST(RenderLoop, GivesUpMeasuringTheErrorOfADeletedSession) {
  Measured test;
  EXPECT_TRUE(test.workshop.store.remove(test.session->id()));
  test.workshop.step();
  test.workshop.errors.finish();
  EXPECT_EQ(test.stopped, 1);
}

TEST(RenderLoop, GivesUpMeasuringTheErrorOfASceneThatAnEditReplaces) {
  Measured test;
  test.session->patch(seedPatch(5), {});
  test.workshop.step();
  test.workshop.errors.finish();
  EXPECT_EQ(test.stopped, 1);
  test.workshop.steps(2);
  EXPECT_FALSE(test.workshop.last.abandoned);  // no build was abandoned
  EXPECT_EQ(test.viewer->frames.back().info.revision, 2u);
  EXPECT_TRUE(test.viewer->failures.empty());
}

TEST(RenderLoop, MeasuresAnewWhenSomebodyWaitsAgain) {
  Measured test;
  test.session->removeViewer(test.viewerId);
  test.workshop.step();
  test.workshop.errors.finish();
  EXPECT_EQ(test.stopped, 1);
  test.workshop.errors.atOnce = true;
  test.session->addViewer(test.viewer);
  test.workshop.steps(6);
  EXPECT_EQ(test.measured, 2);
  EXPECT_EQ(test.stopped, 1);
  EXPECT_TRUE(test.viewer->frames.back().info.final);
}

TEST(EncodeLoop, EncodesALargePictureInTheBackgroundAndTheSmallOneAfterAnEditAtOnce) {
  Workshop workshop;
  const auto session = workshop.store.create({{"image", {{"width", 1024}, {"height", 1024}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.control->secondsPerPixel = 1e-7;
  workshop.render.step();
  workshop.background.atOnce = false;
  workshop.encode.step();
  EXPECT_EQ(workshop.background.waiting.size(), 1u);
  EXPECT_TRUE(viewer->frames.empty());
  session->patch(seedPatch(1), {});
  for (int i = 0; i < 4; ++i) {
    workshop.render.step();
    workshop.encode.step();
  }
  ASSERT_FALSE(viewer->frames.empty());
  EXPECT_EQ(viewer->frames.front().info.revision, 2u);
  // The encoding of the picture before the edit ends too late.
  const auto count = viewer->frames.size();
  workshop.background.finish();
  workshop.encode.step();
  for (const auto& frame : viewer->frames) EXPECT_EQ(frame.info.revision, 2u);
  EXPECT_GE(viewer->frames.size(), count);
}

}  // namespace
}  // namespace scolopax::server
