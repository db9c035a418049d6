// SPDX-License-Identifier: Apache-2.0
#include "server/edit_queue.h"

#include <gtest/gtest.h>

#include <thread>

#include "protocol/problem.h"
#include "protocol/scene_json.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using protocol::ProtocolError;
using testing::gradientPatch;
using testing::seedPatch;
using testing::Workshop;

/// A client of a session.
struct Editor {
  std::shared_ptr<Session> session;
  std::shared_ptr<EditQueue> queue;
  std::vector<std::string> failures;

  Editor(SessionStore& store, Background& background)
      : session(store.create(json::object())),
        queue(std::make_shared<EditQueue>(background, session->id())) {}

  void patch(const json& patch, std::size_t bytes = 100) {
    const auto apply = [this, patch] { session->patch(patch, {}); };
    const auto failed = [this](const std::exception_ptr& failure) {
      try {
        std::rethrow_exception(failure);
      } catch (const std::exception& error) {
        failures.emplace_back(error.what());
      }
    };
    queue->push({apply, failed, bytes});
  }
  int statusOf(const json& patched, std::size_t bytes = 100) {
    try {
      patch(patched, bytes);
    } catch (const ProtocolError& error) {
      return error.status;
    }
    return 200;
  }
  std::uint32_t revision() const { return session->scene().revision; }
  json resolved() const { return protocol::toJson(session->scene().scene->resolved); }
};

TEST(EditQueue, AppliesWhatNeedsNoMeasuringAtOnce) {
  Workshop workshop;
  workshop.background.atOnce = false;
  Editor editor(workshop.store, workshop.background);
  editor.patch(seedPatch(3));
  editor.patch({{"image", {{"width", 0}}}});
  editor.patch(seedPatch(4));
  EXPECT_EQ(editor.revision(), 3u);
  EXPECT_EQ(editor.resolved()["integrator"]["seed"], 4);
  ASSERT_EQ(editor.failures.size(), 1u);
  EXPECT_EQ(editor.failures[0].substr(0, 12), "/image/width");
  EXPECT_TRUE(workshop.background.waiting.empty());
}

TEST(EditQueue, MakesAnEditWaitForItsMeasuringAndNobodyElse) {
  Workshop workshop;
  workshop.background.atOnce = false;
  Editor editor(workshop.store, workshop.background), other(workshop.store, workshop.background);
  EXPECT_THROW(editor.session->patch(gradientPatch(), {}), Unmeasured);
  EXPECT_EQ(editor.revision(), 1u);

  editor.patch(gradientPatch());
  editor.patch(seedPatch(7));
  EXPECT_EQ(workshop.background.waiting.size(), 1u);
  EXPECT_EQ(editor.revision(), 1u);
  // Another session, another client of this one, and the render thread are not delayed.
  other.patch(seedPatch(8));
  EXPECT_EQ(other.revision(), 2u);
  editor.session->patch(seedPatch(9), {});
  EXPECT_EQ(editor.revision(), 2u);
  EXPECT_EQ(editor.session->request().scene->render.seed, 9u);

  workshop.background.finish();
  EXPECT_EQ(editor.revision(), 4u);
  EXPECT_EQ(editor.resolved()["integrator"]["seed"], 7) << "in their order";
  EXPECT_EQ(editor.resolved()["channels"][0]["gradientOpacity"]["range"].size(), 2u);
  EXPECT_TRUE(editor.failures.empty());
  // The measurement is known from now on.
  other.patch(gradientPatch());
  EXPECT_EQ(other.revision(), 3u);
  EXPECT_TRUE(workshop.background.waiting.empty());
}

TEST(EditQueue, MeasuresWhatSeveralEditsNeedOneAfterTheOther) {
  Workshop workshop;
  workshop.background.atOnce = false;
  Editor editor(workshop.store, workshop.background);
  const json steep = json::object(),
             both{{"0", {{"gradientOpacity", steep}}}, {"1", {{"gradientOpacity", steep}}}};
  editor.patch({{"channels", both}});
  editor.patch({{"dataset", "other"}});
  editor.patch({{"image", {{"width", 0}}}});
  editor.patch(seedPatch(7));
  workshop.background.finish();
  EXPECT_EQ(editor.revision(), 4u);
  EXPECT_EQ(editor.resolved()["dataset"], "other");
  EXPECT_EQ(editor.resolved()["integrator"]["seed"], 7);
  EXPECT_EQ(editor.failures.size(), 1u);
  EXPECT_TRUE(workshop.background.waiting.empty()) << "all in one job";
}

TEST(EditQueue, FailsWhatWaitsWhenItsClientLeaves) {
  Workshop workshop;
  workshop.background.atOnce = false;
  Editor editor(workshop.store, workshop.background);
  editor.patch(gradientPatch());
  editor.patch(seedPatch(7));
  editor.queue->end();
  workshop.background.finish();
  EXPECT_EQ(editor.revision(), 1u);
  EXPECT_EQ(editor.failures.size(), 2u);
  EXPECT_THROW(editor.session->patch(gradientPatch(), {}), Unmeasured) << "nor was it measured";
}

TEST(EditQueue, TellsWhyWhatIsNeededCannotBeMeasured) {
  Workshop workshop;
  const auto datasets = testing::smallStore(std::make_shared<MemoryBudget>(1000));
  SessionStore store(std::make_shared<const SceneResolver>(datasets, SceneResolver::Options{16'777'216}),
                     {32, std::chrono::minutes(5)}, workshop.hooks);
  Editor editor(store, workshop.background);
  editor.patch(gradientPatch());
  editor.patch(seedPatch(7));
  ASSERT_EQ(editor.failures.size(), 1u);
  EXPECT_NE(editor.failures[0].find("MiB"), std::string::npos) << editor.failures[0];
  EXPECT_EQ(editor.revision(), 2u);
  EXPECT_EQ(editor.resolved()["integrator"]["seed"], 7);
}

TEST(EditQueue, RefusesMoreThanMayWait) {
  Workshop workshop;
  workshop.background.atOnce = false;
  Editor many(workshop.store, workshop.background), large(workshop.store, workshop.background);
  EXPECT_EQ(many.statusOf(gradientPatch()), 200);
  for (std::size_t i = 1; i < EditQueue::kMaxEdits; ++i) EXPECT_EQ(many.statusOf(seedPatch(1)), 200);
  EXPECT_EQ(many.statusOf(seedPatch(2)), 429);
  EXPECT_EQ(large.statusOf(gradientPatch(), 10 * EditQueue::kMaxBytes), 200) << "a single one";
  EXPECT_EQ(large.statusOf(seedPatch(2), 0), 429);
  workshop.background.finish();
  EXPECT_EQ(many.revision(), 1 + EditQueue::kMaxEdits);
  EXPECT_EQ(large.revision(), 2u);
  EXPECT_EQ(many.statusOf(seedPatch(2)), 200) << "there is room again";
  EXPECT_EQ(large.statusOf(seedPatch(2)), 200);
}

TEST(EditQueue, KeepsTheOrderOnThreadsOfItsOwn) {
  const SessionHooks hooks{[] { return std::chrono::steady_clock::now(); }, [] {}, [] {}, [] {}};
  SessionStore store(
      std::make_shared<const SceneResolver>(testing::smallStore(), SceneResolver::Options{16'777'216}),
      {32, std::chrono::minutes(5)}, hooks);
  BackgroundThreads background;
  Editor editor(store, background), leaving(store, background);
  leaving.patch(gradientPatch());
  leaving.queue->end();
  const std::uint32_t left = leaving.revision();
  editor.patch(gradientPatch());
  for (std::uint32_t i = 1; i <= 100; ++i) editor.patch(seedPatch(i));
  while (editor.revision() < 102) std::this_thread::yield();
  EXPECT_EQ(editor.resolved()["integrator"]["seed"], 100);
  EXPECT_TRUE(editor.resolved()["channels"][0].contains("gradientOpacity"));
  editor.queue->end();
  EXPECT_EQ(leaving.revision(), left) << "nothing is applied after the end";
}

}  // namespace
}  // namespace scolopax::server
