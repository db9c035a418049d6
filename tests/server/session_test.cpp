// SPDX-License-Identifier: Apache-2.0
#include "server/session.h"

#include <gtest/gtest.h>

#include <future>
#include <latch>
#include <thread>

#include "protocol/problem.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using protocol::ProtocolError;
using testing::FakeViewer;
using testing::seedPatch;
using testing::Workshop;

TEST(Session, CountsARevisionPerEdit) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  EXPECT_EQ(session->scene().revision, 1u);
  EXPECT_EQ(session->patch(seedPatch(5), {}).revision, 2u);
  EXPECT_EQ(session->patch(seedPatch(5), {}).revision, 3u);
  EXPECT_EQ(session->scene().scene->render.seed, 5u);
}

TEST(Session, LeavesTheSceneAsItWasWhenAnEditIsBad) {
  Workshop workshop;
  const auto session = workshop.store.create(seedPatch(5));
  try {
    session->patch({{"integrator", {{"seed", 6}}}, {"channels", {{"1", {{"gamma", -1}}}}}}, {});
    FAIL() << "no error";
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    EXPECT_EQ(error.pointer, "/channels/1/gamma");
  }
  EXPECT_EQ(session->scene().revision, 1u);
  EXPECT_EQ(session->scene().scene->render.seed, 5u);
}

TEST(Session, RefusesAnEditOfAnotherRevisionWith409) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  EXPECT_EQ(session->patch(seedPatch(1), {0, 0, 1}).revision, 2u);
  try {
    session->patch(seedPatch(2), {0, 0, 1});
    FAIL() << "no error";
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 409);
  }
  EXPECT_EQ(session->scene().scene->render.seed, 1u);
}

TEST(Session, ReplacesTheWholeScene) {
  Workshop workshop;
  const auto session = workshop.store.create({{"integrator", {{"seed", 5}}}, {"image", {{"width", 32}}}});
  session->replace({{"image", {{"height", 16}}}}, {});
  EXPECT_EQ(session->scene().scene->sparse.whole(), (json{{"image", {{"height", 16}}}}));
  EXPECT_EQ(session->scene().scene->render.seed, 0u);
  EXPECT_EQ(session->scene().scene->stop.samples, kSessionSamples);
}

TEST(Session, TellsTheOtherViewersOfAnEdit) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto editor = std::make_shared<FakeViewer>(), other = std::make_shared<FakeViewer>();
  const ViewerId id = session->addViewer(editor);
  session->addViewer(other);
  session->patch({{"channels", {{"1", {{"color", "#102030"}}}}}}, {id, 7, {}});
  EXPECT_TRUE(editor->scenes.empty());
  ASSERT_EQ(other->scenes.size(), 1u);
  EXPECT_EQ(other->scenes[0].first, 2u);
  EXPECT_EQ(other->scenes[0].second, (json{{"channels", {{"1", {{"color", "#102030"}}}}}}));
}

TEST(Session, WritesTheMessageAboutAnEditOnceForAllViewers) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto first = std::make_shared<FakeViewer>(), second = std::make_shared<FakeViewer>();
  session->addViewer(first);
  session->addViewer(second);
  session->patch(seedPatch(1), {});
  ASSERT_EQ(first->messages.size(), 1u);
  EXPECT_EQ(first->messages, second->messages);
}

/// Resolves no patch until the test releases it.
class HeldResolver : public SceneResolver {
 public:
  HeldResolver() : SceneResolver(testing::smallStore(), {16'777'216}) {}
  Resolved patchNow(const ResolvedScene& base, const json& patch) const override {
    entered.count_down();
    released.wait();
    return SceneResolver::patchNow(base, patch);
  }
  mutable std::latch entered{1};
  std::latch released{1};
};

TEST(Session, ServesTheLoopsAndNewViewersWhileAnEditIsResolved) {
  Workshop workshop;
  const auto resolver = std::make_shared<HeldResolver>();
  Session session("id", "token", resolver, resolver->replaceNow(json::object()), workshop.hooks);
  std::thread editor([&] { session.patch(seedPatch(5), {}); });
  resolver->entered.wait();
  const auto viewer = std::make_shared<FakeViewer>();
  auto served = std::async(std::launch::async, [&] {
    session.addViewer(viewer);
    session.deliver();
    return session.request().revision;
  });
  const bool inTime = served.wait_for(10s) == std::future_status::ready;
  resolver->released.count_down();
  editor.join();
  ASSERT_TRUE(inTime);
  EXPECT_EQ(served.get(), 1u);
  EXPECT_EQ(session.request().revision, 2u);
  EXPECT_EQ(viewer->scenes, (std::vector<std::pair<std::uint32_t, json>>{{2, seedPatch(5)}}));
}

TEST(Session, RefusesAnEditWhoseRevisionEndedWhileItWasResolved) {
  Workshop workshop;
  const auto resolver = std::make_shared<HeldResolver>();
  Session session("id", "token", resolver, resolver->replaceNow(json::object()), workshop.hooks);
  int status = 0;
  std::thread editor([&] {
    try {
      session.patch(seedPatch(5), {0, 0, 1});
    } catch (const ProtocolError& error) {
      status = error.status;
    }
  });
  resolver->entered.wait();
  EXPECT_EQ(session.waitForFrame({0, 1, true}, 0ms), nullptr);  // begins a revision
  resolver->released.count_down();
  editor.join();
  EXPECT_EQ(status, 409);
  EXPECT_EQ(session.scene().scene->render.seed, 0u);
}

TEST(Session, RendersNothingThatNobodyLooksAt) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  workshop.steps(3);
  EXPECT_TRUE(workshop.control->passes.empty());
  const auto viewer = std::make_shared<FakeViewer>();
  const ViewerId id = session->addViewer(viewer);
  workshop.steps(3);
  EXPECT_EQ(workshop.control->passes.size(), 3u);
  session->setView(id, false, 0);
  workshop.steps(3);
  EXPECT_EQ(workshop.control->passes.size(), 3u);
}

TEST(Session, CoalescesTheEditsBetweenTwoPasses) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  const ViewerId id = session->addViewer(viewer);
  for (std::uint32_t i = 1; i <= 10; ++i) session->patch(seedPatch(i), {id, i, {}});
  workshop.step();
  EXPECT_EQ(workshop.control->passes, std::vector<std::uint32_t>{10});
  ASSERT_EQ(viewer->frames.size(), 1u);
  EXPECT_EQ(viewer->frames[0].info.revision, 11u);
  EXPECT_EQ(viewer->frames[0].patch, 10u);
}

TEST(Session, SaysInEachFrameWhichOfTheViewersPatchesItContains) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>(), other = std::make_shared<FakeViewer>();
  const ViewerId id = session->addViewer(viewer);
  session->addViewer(other);
  session->patch(seedPatch(1), {id, 41, {}});
  workshop.control->duringPass = [&] {
    workshop.control->duringPass = nullptr;
    session->patch(seedPatch(2), {id, 42, {}});  // too late for this pass
  };
  workshop.step();
  workshop.step();
  ASSERT_EQ(viewer->frames.size(), 2u);
  EXPECT_EQ(viewer->frames[0].patch, 41u);
  EXPECT_EQ(viewer->frames[0].info.revision, 2u);
  EXPECT_EQ(viewer->frames[1].patch, 42u);
  EXPECT_EQ(other->frames[1].patch, 0u);
}

TEST(Session, ShowsANewViewerTheLatestFrameAtOnce) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 2}}}});
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(4);
  const auto late = std::make_shared<FakeViewer>();
  session->addViewer(late);
  workshop.encode.step();
  ASSERT_EQ(late->frames.size(), 1u);
  EXPECT_TRUE(late->frames[0].info.final);
  EXPECT_EQ(workshop.control->passes.size(), 2u);
}

TEST(Session, HonoursAViewersFrameRateAndStillShowsTheLastFrame) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 4}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->setView(session->addViewer(viewer), true, 10);
  workshop.steps(6);
  EXPECT_EQ(viewer->frames.size(), 1u);
  const auto next = workshop.encode.step();
  ASSERT_TRUE(next);
  EXPECT_EQ(*next, workshop.hooks.now() + 100ms);
  workshop.clock.advance(100ms);
  workshop.encode.step();
  ASSERT_EQ(viewer->frames.size(), 2u);
  EXPECT_TRUE(viewer->frames[1].info.final);
}

TEST(Session, TakesTheSmallestRateForOneFrameAnHour) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  session->setView(session->addViewer(viewer), true, 1e-300);
  for (int i = 0; i < 10; ++i) {
    workshop.step();
    workshop.clock.advance(1s);
  }
  EXPECT_EQ(viewer->frames.size(), 1u);
  EXPECT_EQ(session->deliver(), workshop.hooks.now() - 10s + 1h);
}

TEST(Session, GivesAScriptTheFrameItWaitsFor) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  EXPECT_EQ(session->waitForFrame({}, 0ms), nullptr);
  // The session renders only because a script waits, so another thread drives the loops meanwhile.
  std::atomic<bool> done{false};
  std::thread loops([&] {
    while (!done) workshop.step();
  });
  const auto frame = session->waitForFrame({0, 100}, 60s);
  done = true;
  loops.join();
  ASSERT_NE(frame, nullptr);
  EXPECT_GE(frame->info.samples, 100u);
  EXPECT_FALSE(frame->info.interactive);
}

TEST(Session, StopsWaitingForAScriptThatHasGone) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  std::stop_source gone;
  gone.request_stop();
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(session->waitForFrame({0, 1, false, gone.get_token()}, 60s), nullptr);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 30s);
  EXPECT_FALSE(session->request().wanted);
}

TEST(Session, MakesARevisionWhenAovsAreAskedForFirst) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 3}}}});
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.steps(5);
  ASSERT_TRUE(viewer->frames.back().info.final);
  EXPECT_EQ(session->waitForFrame({0, 1, true}, 0ms), nullptr);  // that frame has no AOVs
  workshop.steps(8);
  // Nothing better may follow a final frame of a revision, so these frames are of the next one.
  EXPECT_EQ(viewer->frames.back().info.revision, 2u);
  const auto frame = session->waitForFrame({0, 1, true}, 0ms);
  ASSERT_NE(frame, nullptr);
  ASSERT_TRUE(frame->aovs);
  EXPECT_EQ(frame->aovs->size(), 4u);
  EXPECT_EQ(session->scene().revision, 2u);
}

TEST(Session, RecordsAovsUntilAnEditLongAfterTheLastQueryForThem) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  session->waitForFrame({0, 1, true}, 0ms);
  workshop.clock.advance(59s);
  session->patch(seedPatch(1), {});
  EXPECT_TRUE(session->request().aovs);
  workshop.clock.advance(1s);
  EXPECT_TRUE(session->request().aovs);
  session->patch(seedPatch(2), {});
  EXPECT_FALSE(session->request().aovs);
  session->waitForFrame({0, 1, true}, 0ms);
  EXPECT_TRUE(session->request().aovs);
}

TEST(Session, RecordsNoAovsForWhichThereIsNeverMemory) {
  Workshop workshop;
  const auto resolver = std::make_shared<const SceneResolver>(
      testing::smallStore(),
      SceneResolver::Options{.maxPixels = 16'777'216, .memory = std::make_shared<MemoryBudget>(64 << 20)});
  const auto sized = [](int side) { return json{{"image", {{"width", side}, {"height", side}}}}; };
  Session session("id", "token", resolver, resolver->replaceNow(sized(700)), workshop.hooks);
  try {
    session.waitForFrame({0, 1, true}, 0ms);
    FAIL() << "no error";
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    EXPECT_EQ(error.pointer, "/aov");
  }
  EXPECT_FALSE(session.request().aovs);
  EXPECT_EQ(session.scene().revision, 1u);
  // An edit cannot lead to this either: it ends the recording.
  session.patch(sized(100), {});
  session.waitForFrame({0, 1, true}, 0ms);
  EXPECT_TRUE(session.request().aovs);
  session.patch(sized(700), {});
  EXPECT_FALSE(session.request().aovs);
}

TEST(Session, GivesAScriptTheFinalFrameWhenThereCannotBeMoreSamples) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 3}}}});
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(5);
  const auto frame = session->waitForFrame({0, 1000}, 0ms);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->info.samples, 3u);
  EXPECT_EQ(session->waitForFrame({frame->info.number, 1}, 0ms), nullptr);
}

TEST(Session, NeverGivesAScriptAPictureFromBeforeItsEdit) {
  Workshop workshop;
  const auto session = workshop.store.create({{"stop", {{"samples", 1}}}});
  session->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(3);
  EXPECT_NE(session->waitForFrame({}, 0ms), nullptr);
  session->patch(seedPatch(9), {});
  EXPECT_EQ(session->waitForFrame({}, 0ms), nullptr);
}

TEST(Session, TellsViewersAndScriptsThatASceneCannotBeRendered) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  workshop.control->failure = "macrocell: expected more memory";
  workshop.steps(3);
  EXPECT_EQ(viewer->failures, std::vector<std::string>{"macrocell: expected more memory"});
  EXPECT_THROW(session->waitForFrame({}, 0ms), Error);
  // The next edit makes the session try again.
  workshop.control->failure.clear();
  session->patch(seedPatch(1), {});
  workshop.steps(1);
  EXPECT_EQ(viewer->frames.size(), 1u);
}

TEST(Session, ServesOthersWhileAnOldPictureIsReleased) {
  // Before the workshop, which releases the last pictures.
  std::vector<std::future<std::size_t>> answers;
  bool asks = true;
  int served = 0;
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  // A picture whose release another thread's request interrupts.
  const auto image = [&] {
    return std::shared_ptr<const Image>(new Image(), [&](const Image* released) {
      delete released;
      if (!asks) return;
      answers.push_back(std::async(std::launch::async, [&] { return session->viewerCount(); }));
      served += answers.back().wait_for(10s) == std::future_status::ready;
    });
  };
  for (int i = 0; i < 3; ++i) {
    EncodedFrame encoded;
    encoded.image = image();
    session->publish(std::move(encoded));
    RenderedFrame rendered;
    rendered.image = image();
    session->submit(std::move(rendered));
  }
  EXPECT_EQ(served, 4);
  asks = false;
}

TEST(Session, WakesWhoWaitsWhenItIsClosed) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  session->addViewer(viewer);
  std::thread closing([&] { session->close("the end"); });
  EXPECT_EQ(session->waitForFrame({}, 60s), nullptr);
  closing.join();
  EXPECT_EQ(viewer->closed, "the end");
  EXPECT_THROW(session->patch(seedPatch(1), {}), ProtocolError);
  workshop.steps(2);
  EXPECT_TRUE(workshop.control->passes.empty());
}

}  // namespace
}  // namespace scolopax::server
