// SPDX-License-Identifier: Apache-2.0
// Picks take turns with pictures, go on in the background where their rays are slow, and end when nobody
// waits.
#include "server/current_pick.h"

#include <gtest/gtest.h>

#include <stop_token>
#include <thread>
#include <vector>

#include "server/render_jobs.h"
#include "tests/server/picker.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::FakeViewer;
using testing::Picker;
using testing::pickProblem;
using testing::seedPatch;

/// A pick, and another session with a viewer, at which edits arrive.
struct PickBesideAnother : Picker {
  std::shared_ptr<Session> other = workshop.store.create(seedPatch(1));
  std::shared_ptr<FakeViewer> viewer = std::make_shared<FakeViewer>();
  std::uint32_t seed = 100;

  PickBesideAnother() {
    workshop.passes.atOnce = false;
    other->addViewer(viewer);
    workshop.steps(3);
  }
  void editOther() { other->patch(seedPatch(++seed), {}); }
  std::size_t inBackground() const { return workshop.passes.waiting.size(); }
  /// Has the pick's rays take longer than the limit.
  void beSlow() {
    workshop.control->duringPick = [this] {
      workshop.clock.advance(8ms + RenderPart::kSlowRay);
      workshop.render.watch();
    };
  }
  /// Begins a pick that goes on in the background.
  void pickSlowly() {
    beSlow();
    pick();
    workshop.steps(2);
    workshop.control->duringPick = {};
    EXPECT_EQ(inBackground(), 1u);
    EXPECT_EQ(workshop.control->cancelledPicks, 1);
    EXPECT_TRUE(answers.empty());
  }
};

TEST(CurrentPick, InterruptsAPass) {
  Picker picker;
  picker.session->addViewer(std::make_shared<FakeViewer>());
  picker.workshop.steps(2);
  const auto passes = picker.workshop.control->passes.size();
  picker.workshop.control->duringPass = [&] {
    picker.workshop.control->duringPass = nullptr;
    picker.pick();
  };
  picker.workshop.step();
  EXPECT_EQ(picker.workshop.control->passes.size(), passes);
  picker.workshop.step();
  EXPECT_EQ(picker.answers.size(), 1u);
}

TEST(CurrentPick, ThatTakesLongLeavesThePictureEveryOtherTurn) {
  Picker picker;
  picker.session->addViewer(std::make_shared<FakeViewer>());
  picker.workshop.steps(2);
  const auto passes = picker.workshop.control->passes.size();
  picker.workshop.control->incompletePicks = 3;
  picker.pick();
  picker.workshop.steps(6);
  EXPECT_TRUE(picker.answers.empty());
  EXPECT_EQ(picker.workshop.control->passes.size(), passes + 3);
  picker.workshop.step();
  EXPECT_EQ(picker.answers.size(), 1u);
  EXPECT_EQ(picker.workshop.control->picks.size(), 1u);  // the pick continued where it had stopped
}

TEST(CurrentPick, KeepsToItsSceneWhateverEditsCome) {
  for (const json& edit : {seedPatch(6), json{{"dataset", "other"}}}) {
    Picker picker;
    picker.workshop.control->incompletePicks = 2;
    picker.pick();
    for (int i = 0; i < 6; ++i) {
      picker.workshop.step();
      if (picker.answers.empty()) picker.session->patch(edit, {});
    }
    ASSERT_EQ(picker.answers.size(), 1u);
    EXPECT_EQ(picker.answers[0].found["revision"], 1);
    EXPECT_EQ(picker.workshop.control->picks, std::vector<std::uint32_t>{5});
    // What is asked after an edit is of the scene after it.
    picker.pick();
    const auto revision = picker.session->scene().revision;
    picker.workshop.steps(3);
    ASSERT_EQ(picker.answers.size(), 2u);
    EXPECT_EQ(picker.answers[1].found["revision"], revision);
  }
}

TEST(CurrentPick, BeginsThoughEditsComeFasterThanScenesAreBuilt) {
  Picker picker;
  picker.workshop.background.atOnce = false;
  picker.session->addViewer(std::make_shared<FakeViewer>());
  picker.workshop.step();
  picker.pick();
  picker.session->patch(seedPatch(6), {});  // comes during the build
  picker.workshop.background.finish();
  picker.workshop.step();
  ASSERT_EQ(picker.answers.size(), 1u);
  EXPECT_EQ(picker.answers[0].found["revision"], 1);
}

TEST(CurrentPick, IsInterruptedByAnEditOfAnotherSessionAndGoesOnAfterItsPicture) {
  PickBesideAnother test;
  test.workshop.control->duringPick = [&] {
    test.workshop.control->duringPick = {};
    test.editOther();
  };
  test.pick();
  test.workshop.step();
  EXPECT_EQ(test.workshop.control->cancelledPicks, 1);
  test.workshop.step();
  EXPECT_EQ(test.viewer->frames.back().red, float(test.seed));
  EXPECT_TRUE(test.answers.empty());
  test.workshop.steps(2);
  EXPECT_EQ(test.answers.size(), 1u);
  EXPECT_EQ(test.inBackground(), 0u);
  EXPECT_EQ(test.workshop.control->picks, std::vector<std::uint32_t>{5});
}

TEST(CurrentPick, ThatEditsKeepInterruptingGoesOnInTheBackgroundWhereTheyDoNot) {
  PickBesideAnother test;
  test.workshop.control->duringPick = [&] { test.editOther(); };
  test.pick();
  test.workshop.steps(8);
  EXPECT_EQ(test.workshop.control->cancelledPicks, 2);
  ASSERT_EQ(test.inBackground(), 1u);
  test.workshop.passes.finish();
  test.workshop.steps(2);
  EXPECT_EQ(test.workshop.control->cancelledPicks, 2);
  EXPECT_EQ(test.answers.size(), 1u);
}

TEST(CurrentPick, StaysInTurnsWhileItMakesProgressBetweenEdits) {
  PickBesideAnother test;
  test.workshop.control->incompletePicks = 100;
  int calls = 0;
  test.workshop.control->duringPick = [&] {
    if (++calls % 2 == 0) test.editOther();
  };
  test.pick();
  test.workshop.steps(60);
  EXPECT_GT(test.workshop.control->cancelledPicks, 5);
  EXPECT_EQ(test.inBackground(), 0u);
}

TEST(CurrentPick, OfWhichASingleRayTakesTooLongGoesOnInTheBackground) {
  for (const bool tooLong : {false, true}) {
    PickBesideAnother test;
    test.workshop.control->duringPick = [&] {
      test.workshop.control->duringPick = {};
      test.workshop.clock.advance(8ms + RenderPart::kSlowRay - (tooLong ? 0ms : 1ms));
      test.workshop.render.watch();
    };
    test.pick();
    test.workshop.steps(2);
    EXPECT_EQ(test.answers.size(), tooLong ? 0u : 1u);
    ASSERT_EQ(test.inBackground(), tooLong ? 1u : 0u);
    // Others have their turns meanwhile.
    test.editOther();
    test.workshop.steps(2);
    EXPECT_EQ(test.viewer->frames.back().red, float(test.seed));
    test.workshop.passes.finish();
    test.workshop.steps(2);
    EXPECT_EQ(test.answers.size(), 1u);
  }
}

TEST(CurrentPick, OfWhichEveryRayTakesATurnGoesOnInTheBackgroundAPartAtATime) {
  PickBesideAnother test;
  test.workshop.control->samplesPerTurn = 1;
  test.workshop.control->incompletePicks = 5;
  test.pick();
  test.workshop.steps(10);
  EXPECT_EQ(test.workshop.control->incompletePicks, 3);  // two turns before it goes there
  for (int left = 3; left >= 0; --left) {
    ASSERT_EQ(test.inBackground(), 1u);
    EXPECT_EQ(test.workshop.control->incompletePicks, left);
    EXPECT_TRUE(test.answers.empty());
    test.workshop.passes.finish();
    test.workshop.steps(2);
  }
  EXPECT_EQ(test.answers.size(), 1u);
  EXPECT_EQ(test.inBackground(), 0u);
  for (const std::string& flow : test.workshop.passes.flows) EXPECT_EQ(flow, test.session->id());
}

TEST(CurrentPick, AfterASlowOneBeginsInTheBackgroundForAWhile) {
  PickBesideAnother test;
  test.pickSlowly();
  test.workshop.passes.finish();
  test.workshop.steps(2);
  EXPECT_EQ(test.answers.size(), 1u);
  test.pick();
  test.workshop.steps(2);
  EXPECT_EQ(test.inBackground(), 1u);
  test.workshop.passes.finish();
  test.workshop.clock.advance(RenderPart::kSlowTime);
  test.workshop.steps(2);
  EXPECT_EQ(test.answers.size(), 2u);
  test.pick();
  test.workshop.steps(2);
  EXPECT_EQ(test.answers.size(), 3u);
  EXPECT_EQ(test.inBackground(), 0u);
}

TEST(CurrentPick, InTheBackgroundLeavesTurnsAndTheirLengthToThePicturesOfItsSession) {
  PickBesideAnother test;
  const auto watching = std::make_shared<FakeViewer>();
  test.session->addViewer(watching);
  test.workshop.steps(4);
  test.pickSlowly();
  test.other->close("");
  test.session->patch(seedPatch(6), {});
  test.workshop.steps(4);
  EXPECT_EQ(watching->frames.back().red, 6);
  EXPECT_EQ(test.workshop.control->budgets.back(), RenderPolicy().slice);
  EXPECT_EQ(test.inBackground(), 1u);
}

TEST(CurrentPick, InTheBackgroundMakesNoPicturesThatNobodyWants) {
  PickBesideAnother test;
  test.other->close("");
  const ViewerId viewer = test.session->addViewer(std::make_shared<FakeViewer>());
  test.workshop.steps(2);
  test.session->patch(seedPatch(6), {});
  test.workshop.steps(2);
  test.session->removeViewer(viewer);
  const auto passes = test.workshop.control->passes.size();
  test.pickSlowly();
  test.workshop.steps(5);
  EXPECT_EQ(test.workshop.control->passes.size(), passes);
  EXPECT_GT(test.workshop.render.step(), test.workshop.hooks.now());  // it sleeps
}

TEST(CurrentPick, EndsAtOnceWhenItsViewerLeaves) {
  PickBesideAnother test;
  const ViewerId viewer = test.session->addViewer(std::make_shared<FakeViewer>());
  test.session->setView(viewer, false, 0);
  test.workshop.control->duringPick = [&] { test.session->removeViewer(viewer); };
  test.session->pick(
      {1, 2}, [](const PickAnswer&) {}, viewer);
  test.workshop.steps(3);
  EXPECT_EQ(test.workshop.control->cancelledPicks, 1);
  EXPECT_EQ(test.inBackground(), 0u);
}

TEST(CurrentPick, EndsAtOnceWhenItsRequestIsGone) {
  PickBesideAnother test;
  std::stop_source gone;
  std::thread asking([&] {
    EXPECT_FALSE(test.session->waitForPick({1, 2}, 60s, gone.get_token()).has_value());
  });
  while (!test.session->request().pick) std::this_thread::yield();
  test.workshop.control->duringPick = [&] {
    gone.request_stop();
    while (test.session->request().pick) std::this_thread::yield();
  };
  test.workshop.steps(3);
  asking.join();
  EXPECT_EQ(test.workshop.control->cancelledPicks, 1);
  EXPECT_EQ(test.inBackground(), 0u);
}

/// How a pick in the background is abandoned.
enum class Left { viewerLeaves, sessionCloses, sessionIsDeleted };

TEST(CurrentPick, InTheBackgroundEndsWhenNobodyWaitsForIt) {
  for (const Left how : {Left::viewerLeaves, Left::sessionCloses, Left::sessionIsDeleted}) {
    PickBesideAnother test;
    const ViewerId viewer = test.session->addViewer(std::make_shared<FakeViewer>());
    test.session->setView(viewer, false, 0);
    test.beSlow();
    test.session->pick(
        {1, 2}, [](const PickAnswer&) {}, viewer);
    test.workshop.steps(3);
    ASSERT_EQ(test.inBackground(), 1u);
    if (how == Left::viewerLeaves) test.session->removeViewer(viewer);
    if (how == Left::sessionCloses) test.session->close("the end");
    if (how == Left::sessionIsDeleted) {
      EXPECT_TRUE(test.workshop.store.remove(test.session->id()));
    }
    test.workshop.step();
    test.workshop.control->duringPick = {};
    test.workshop.passes.finish();
    test.workshop.steps(2);
    EXPECT_EQ(test.workshop.control->cancelledPicks, 2);  // one was interrupted, and one ended
    EXPECT_EQ(test.inBackground(), 0u);
  }
}

TEST(CurrentPick, EndsWhenTheLoopStops) {
  PickBesideAnother test;
  test.workshop.control->duringPick = [&] { test.workshop.render.stop(); };
  test.pick();
  test.workshop.step();
  EXPECT_EQ(test.workshop.control->cancelledPicks, 1);
}

TEST(CurrentPick, ThatTakesTooLongIsToldSoAndLeavesItsPlaceToTheNext) {
  PickBesideAnother test;
  test.other->close("");
  const TimePoint begin = test.workshop.hooks.now();
  test.pickSlowly();
  test.pick({3, 4});
  test.workshop.step();
  EXPECT_EQ(test.workshop.render.step(), begin + 60s);
  test.workshop.clock.advance(59s);
  test.workshop.step();
  EXPECT_TRUE(test.answers.empty());
  test.workshop.clock.advance(1s);
  test.workshop.steps(3);
  ASSERT_EQ(test.answers.size(), 2u);
  EXPECT_EQ(pickProblem(test.answers[0]).first, 422);
  EXPECT_NE(pickProblem(test.answers[0]).second.find("did not finish within 60 seconds"), std::string::npos);
  EXPECT_FALSE(test.answers[1].failure);
  test.workshop.passes.finish();
  EXPECT_EQ(test.workshop.control->cancelledPicks, 2);
}

TEST(CurrentPick, ThatFailsInTheBackgroundSaysSo) {
  PickBesideAnother test;
  test.pickSlowly();
  test.workshop.control->pickFailure = "a secret path";
  test.workshop.passes.finish();
  test.workshop.steps(2);
  ASSERT_EQ(test.answers.size(), 1u);
  EXPECT_EQ(pickProblem(test.answers[0]).first, 500);
  EXPECT_EQ(test.workshop.log.size(), 1u);
}

}  // namespace
}  // namespace scolopax::server
