// SPDX-License-Identifier: Apache-2.0
#include "server/session_store.h"

#include <gtest/gtest.h>

#include "protocol/problem.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::FakeViewer;
using testing::seedPatch;
using testing::Workshop;

TEST(SessionStore, EndsASessionSomeTimeAfterItsLastViewer) {
  Workshop workshop({32, 5min});
  const auto session = workshop.store.create(json::object());
  const auto viewer = std::make_shared<FakeViewer>();
  const ViewerId id = session->addViewer(viewer);
  workshop.clock.advance(1h);
  workshop.store.expire();
  EXPECT_NE(workshop.store.find(session->id()), nullptr);
  session->removeViewer(id);
  workshop.clock.advance(5min - 1ms);
  EXPECT_EQ(workshop.store.expire(), workshop.hooks.now() + 1ms);
  EXPECT_NE(workshop.store.find(session->id()), nullptr);
  workshop.clock.advance(1ms);
  EXPECT_EQ(workshop.store.expire(), std::nullopt);
  EXPECT_EQ(workshop.store.find(session->id()), nullptr);
  EXPECT_EQ(workshop.store.findByToken(session->token()), nullptr);
}

TEST(SessionStore, WakesTheLoopThatWillEndANewSession) {
  Workshop workshop({32, 5min});
  EXPECT_EQ(workshop.render.step(), std::nullopt);
  workshop.store.create(json::object());
  EXPECT_EQ(workshop.renderWakes, 1);
  EXPECT_EQ(workshop.render.step(), workshop.hooks.now() + 5min);
}

TEST(SessionStore, KeepsTheFilmBetweenTwoViewers) {
  Workshop workshop({32, 5min});
  const auto session = workshop.store.create({{"stop", {{"samples", 100}}}});
  const ViewerId id = session->addViewer(std::make_shared<FakeViewer>());
  workshop.steps(10);
  session->removeViewer(id);
  workshop.steps(10);
  workshop.clock.advance(4min);
  const auto resumed = workshop.store.findByToken(session->token());
  ASSERT_EQ(resumed, session);
  const auto viewer = std::make_shared<FakeViewer>();
  resumed->addViewer(viewer);
  workshop.encode.step();
  workshop.steps(100);
  EXPECT_EQ(viewer->frames.front().info.samples, 8u);  // the last frame that had been shown
  EXPECT_EQ(viewer->frames.back().info.samples, 100u);
  EXPECT_EQ(workshop.control->passes.size(), 100u);  // no sample was rendered twice
}

TEST(SessionStore, RefusesOneSessionTooManyWith503) {
  Workshop workshop({2, 5min});
  workshop.store.create(json::object());
  const auto second = workshop.store.create(json::object());
  try {
    workshop.store.create(json::object());
    FAIL() << "no error";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_EQ(error.status, 503);
  }
  EXPECT_TRUE(workshop.store.remove(second->id()));
  EXPECT_FALSE(workshop.store.remove(second->id()));
  EXPECT_NE(workshop.store.create(json::object()), nullptr);
}

TEST(SessionStore, EndsAnUnusedSessionOfAClientThatHasMostOfThemForAnotherClient) {
  Workshop workshop({4, 5min});
  std::vector<std::shared_ptr<Session>> of;
  for (int i = 0; i < 4; ++i) {
    of.push_back(workshop.store.create(json::object(), "a"));
    workshop.clock.advance(1s);
  }
  const auto refused = [&](const char* client) {
    try {
      workshop.store.create(json::object(), client);
      return false;
    } catch (const protocol::ProtocolError& error) {
      EXPECT_EQ(error.status, 503);
      return true;
    }
  };
  const auto exists = [&](std::size_t i) { return workshop.store.find(of[i]->id()) != nullptr; };
  EXPECT_TRUE(refused("b"));
  workshop.clock.advance(SessionStore::kUnused - 4s);  // the first has been unused for long enough
  EXPECT_TRUE(refused("a"));
  EXPECT_FALSE(refused("b"));
  EXPECT_FALSE(exists(0));
  EXPECT_TRUE(exists(1));
  of[1]->addViewer(std::make_shared<FakeViewer>());
  workshop.clock.advance(1s);
  EXPECT_TRUE(refused("b"));  // the second has a viewer, the third has not been unused for long enough
  workshop.clock.advance(1s);
  EXPECT_FALSE(refused("b"));
  EXPECT_TRUE(exists(1));
  EXPECT_FALSE(exists(2));
  // Both have half of them. A place that becomes free is for a third.
  workshop.clock.advance(SessionStore::kUnused);
  EXPECT_TRUE(refused("c"));
  EXPECT_TRUE(workshop.store.remove(of[3]->id()));
  EXPECT_TRUE(refused("a"));
  EXPECT_FALSE(refused("c"));
}

/// Counts the scenes that it resolves.
struct CountingResolver : SceneResolver {
  CountingResolver() : SceneResolver(testing::smallStore(), {16'777'216}) {}
  Resolved replaceNow(const json& scene, std::uint32_t defaultSamples) const override {
    ++resolved;
    return SceneResolver::replaceNow(scene, defaultSamples);
  }
  mutable int resolved = 0;
};

TEST(SessionStore, ResolvesNoSceneForWhichThereIsNoSession) {
  Workshop workshop;
  const auto resolver = std::make_shared<const CountingResolver>();
  SessionStore store(resolver, {1, 5min}, workshop.hooks);
  store.create(json::object());
  EXPECT_EQ(resolver->resolved, 1);
  EXPECT_THROW(store.create(json::object()), protocol::ProtocolError);
  store.closeAll("the server is stopping");
  EXPECT_THROW(store.create(json::object()), protocol::ProtocolError);
  EXPECT_EQ(resolver->resolved, 1);
}

TEST(SessionStore, BeginsNoSessionOnceAllHaveBeenClosed) {
  Workshop workshop;
  const auto session = workshop.store.create(json::object());
  workshop.store.closeAll("the server is stopping");
  EXPECT_EQ(session->waitForFrame({}, 1h), nullptr);  // at once
  try {
    workshop.store.create(json::object());
    FAIL() << "no error";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_EQ(error.status, 503);
    EXPECT_STREQ(error.what(), "the server is stopping");
  }
  EXPECT_TRUE(workshop.store.all().empty());
}

TEST(SessionStore, RefusesASceneThatIsNone) {
  Workshop workshop;
  EXPECT_THROW(workshop.store.create({{"nonsense", 1}}), protocol::ProtocolError);
  EXPECT_TRUE(workshop.store.all().empty());
}

TEST(SessionStore, GivesEverySessionItsOwnSecret) {
  Workshop workshop;
  const auto a = workshop.store.create(json::object()), b = workshop.store.create(json::object());
  EXPECT_NE(a->id(), b->id());
  EXPECT_NE(a->token(), b->token());
  EXPECT_NE(a->token(), a->id());
  EXPECT_EQ(workshop.store.findByToken(a->id()), nullptr);
}

}  // namespace
}  // namespace scolopax::server
