// SPDX-License-Identifier: Apache-2.0
// Everything at once, for the thread sanitizer: the invariants must hold under any interleaving.
#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <thread>

#include "protocol/problem.h"
#include "server/loop_thread.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using testing::FakeControl;
using testing::FakeRenderer;
using testing::FakeViewer;
using testing::seedPatch;

/// Sessions served by real loops on real threads.
struct RunningServer {
  LoopThread renderThread, encodeThread;
  std::shared_ptr<FakeControl> control = std::make_shared<FakeControl>();
  Now now = [] { return std::chrono::steady_clock::now(); };
  SessionHooks hooks{now, [this] { renderThread.wake(); }, [this] { encodeThread.wake(); },
                     [this] { render.interrupt(); }};
  SessionStore store{
      std::make_shared<const SceneResolver>(testing::smallStore(), SceneResolver::Options{16'777'216}),
      {1000, 5min},
      hooks};
  LoopThread watchThread;
  BackgroundThreads pictures, passes, errors, builds;
  RenderLoop render{
      store,
      {[this](const std::shared_ptr<const Volume>&) { return std::make_unique<FakeRenderer>(control); },
       {},
       now,
       [](const std::string&) {},
       pictures,
       passes,
       errors,
       builds,
       [this] { renderThread.wake(); },
       nullptr,
       [this] { watchThread.wake(); }},
      [](const PassResult&) {}};
  EncodeLoop encode{store, now, [](const std::string&) {}, pictures, [this] { encodeThread.wake(); }};

  RunningServer() {
    renderThread.start([this] { return render.step(); });
    watchThread.start([this] { return render.watch(); });
    encodeThread.start([this] { return encode.step(); });
  }
  ~RunningServer() {
    store.closeAll("the end");
    renderThread.stop();
    watchThread.stop();
    encodeThread.stop();
  }
};

const nlohmann::json kTinyImage = {{"image", {{"width", 8}, {"height", 8}}}};

TEST(SessionThreads, KeepRevisionsApartWhateverComesTogether) {
  RunningServer server;
  const auto session = server.store.create(kTinyImage);
  std::mutex mutex;
  std::map<std::uint32_t, std::uint32_t> seedOfRevision{{1, 0}};

  const auto watching = std::make_shared<FakeViewer>();
  session->addViewer(watching);
  std::vector<std::thread> threads;
  for (std::uint32_t editor = 1; editor <= 3; ++editor)
    threads.emplace_back([&, editor] {
      for (std::uint32_t i = 0; i < 60; ++i) {
        const auto state = session->patch(seedPatch(editor * 1000 + i), {});
        const std::lock_guard lock(mutex);
        seedOfRevision[state.revision] = state.scene->render.seed;
      }
    });
  for (int visitor = 0; visitor < 2; ++visitor)
    threads.emplace_back([&] {
      for (int i = 0; i < 30; ++i) {
        const ViewerId id = session->addViewer(std::make_shared<FakeViewer>());
        session->setView(id, i % 2 == 0, 1000);
        session->removeViewer(id);
      }
    });
  threads.emplace_back([&] {
    std::uint32_t after = 0;
    for (int i = 0; i < 5; ++i)
      if (const auto frame = session->waitForFrame({after, 1}, 10ms)) after = frame->info.number;
  });
  for (auto& thread : threads) thread.join();
  // After the edits, the last revision is shown.
  const auto last = session->waitForFrame({0, 2}, 60s);
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(last->info.revision, 181u);
  session->close("the end");  // nothing is offered after this

  ASSERT_FALSE(watching->frames.empty());
  std::uint32_t number = 0, revision = 0;
  for (const auto& frame : watching->frames) {
    EXPECT_EQ(frame.red, float(seedOfRevision.at(frame.info.revision)));
    EXPECT_GT(frame.info.number, number);
    EXPECT_GE(frame.info.revision, revision);
    number = frame.info.number;
    revision = frame.info.revision;
  }
  // The viewer was notified of each edit, in order.
  ASSERT_EQ(watching->scenes.size(), 180u);
  for (std::size_t i = 0; i < watching->scenes.size(); ++i) EXPECT_EQ(watching->scenes[i].first, i + 2);
}

TEST(SessionThreads, AnswerEveryPickOnceWhileScenesChangeAndViewersLeave) {
  RunningServer server;
  const auto session = server.store.create(kTinyImage);
  std::atomic<int> found{0}, answers{0};
  std::vector<std::thread> threads;
  for (int script = 0; script < 3; ++script)
    threads.emplace_back([&] {
      for (int i = 0; i < 50; ++i) found += session->waitForPick({1, 2}, 60s).has_value();
    });
  threads.emplace_back([&] {
    for (int i = 0; i < 50; ++i) {
      const ViewerId viewer = session->addViewer(std::make_shared<FakeViewer>());
      session->pick(
          {1, 2}, [&](const PickAnswer&) { ++answers; }, viewer);
      session->removeViewer(viewer);
    }
  });
  threads.emplace_back([&] {
    for (std::uint32_t i = 0; i < 60; ++i) session->patch(seedPatch(i), {});
  });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(found, 150);
  // The render thread may have begun to answer a pick before its viewer left. It answers this one afterwards.
  EXPECT_TRUE(session->waitForPick({1, 2}, 60s));
  EXPECT_EQ(answers, 50);
}

TEST(SessionThreads, MakeAndEndSessionsWhileOthersRender) {
  RunningServer server;
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) {
        const auto session = server.store.create(kTinyImage);
        const auto viewer = std::make_shared<FakeViewer>();
        session->addViewer(viewer);
        if (i % 2 == 0) {
          EXPECT_NE(session->waitForFrame({}, 60s), nullptr);
        }
        EXPECT_TRUE(server.store.remove(session->id()));
        EXPECT_EQ(viewer->closed, "the session was deleted");
      }
    });
  for (auto& thread : threads) thread.join();
  EXPECT_TRUE(server.store.all().empty());
}

}  // namespace
}  // namespace scolopax::server
