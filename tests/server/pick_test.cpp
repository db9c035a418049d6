// SPDX-License-Identifier: Apache-2.0
#include "server/pick.h"

#include <gtest/gtest.h>

#include <future>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include "protocol/problem.h"
#include "tests/server/picker.h"

namespace scolopax::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using protocol::ProtocolError;
using testing::FakeBackground;
using testing::FakeViewer;
using testing::Picker;
using testing::pickProblem;
using testing::seedPatch;
using testing::Workshop;

std::string pointerOf(const PickQuery& query) {
  try {
    areaOf(query, 64, 48);
    return "none";
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    EXPECT_NE(std::string(error.what()).find("expected"), std::string::npos);
    return error.pointer;
  }
}

TEST(PickArea, IsThePixelOrTheRectangleBetweenTwoInAnyOrder) {
  const auto isArea = [](const PickQuery& query, int left, int top, int width, int height) {
    const PixelArea area = areaOf(query, 64, 48);
    return area.left == left && area.top == top && area.width == width && area.height == height;
  };
  EXPECT_TRUE(isArea({0, 0}, 0, 0, 1, 1));
  EXPECT_TRUE(isArea({63.99, 47.5}, 63, 47, 1, 1));
  EXPECT_TRUE(isArea({3.9, 4.1, 3.1, 4.9}, 3, 4, 1, 1));
  EXPECT_TRUE(isArea({10, 4, 3, 20.5}, 3, 4, 8, 17));
}

TEST(PickArea, IsRefusedOutsideOfThePicture) {
  EXPECT_EQ(pointerOf({64, 0}), "/x");
  EXPECT_EQ(pointerOf({-0.01, 0}), "/x");
  EXPECT_EQ(pointerOf({0, 48}), "/y");
  EXPECT_EQ(pointerOf({std::numeric_limits<double>::quiet_NaN(), 0}), "/x");
  EXPECT_EQ(pointerOf({0, 0, 64, 0}), "/x2");
  EXPECT_EQ(pointerOf({0, 0, 0, 1e300}), "/y2");
  EXPECT_EQ(pointerOf({0, 0, 3, {}}), "/y2");
  EXPECT_EQ(pointerOf({0, 0, {}, 3}), "/x2");
}

TEST(Pick, TellsTheValuesOfAllChannelsAlsoOfHiddenOnes) {
  Picker picker;
  picker.session->patch({{"channels", {{{"visible", false}}, {{"name", "leaves"}}}}}, {});
  picker.workshop.control->found = {picker.at({2, 1, 1})};
  picker.pick();
  picker.workshop.step();
  ASSERT_EQ(picker.answers.size(), 1u);
  // Of 4 x 3 x 2 voxels, (2, 1, 1) has index 18.
  EXPECT_EQ(picker.answers[0].found, (json{{"revision", 2},
                                           {"hit", true},
                                           {"point", {2.0, 1.0, 1.0}},
                                           {"voxel", {2, 1, 1}},
                                           {"channel", 1},
                                           {"name", "leaves"},
                                           {"depth", 7.5},
                                           {"values", {18.0, 180.0}}}));
}

TEST(Pick, InterpolatesAndNamesTheNearestVoxelOfTheVolume) {
  Picker picker;
  picker.workshop.control->found = {picker.at({1.25, 0, -0.5000001})};  // on the box's face
  picker.pick();
  picker.workshop.step();
  ASSERT_EQ(picker.answers.size(), 1u);
  EXPECT_EQ(picker.answers[0].found["voxel"], (json{1, 0, 0}));
  EXPECT_EQ(picker.answers[0].found["values"], (json{1.25, 12.5}));
}

TEST(Pick, TellsValuesAsTheyAreInterpolatedInThePicture) {
  Picker picker;
  picker.session->patch({{"channels", {{{"interpolation", "nearest"}}, {{"interpolation", "cubic"}}}}}, {});
  picker.workshop.control->found = {picker.at({1.25, 0, -0.5000001})};
  picker.pick();
  picker.workshop.step();
  ASSERT_EQ(picker.answers.size(), 1u);
  const json& values = picker.answers[0].found["values"];
  EXPECT_EQ(values[0], 1.0);
  // Ten times x + 4 y + 12 z. At the border, a sixth of the spline's weight is one voxel further inside.
  EXPECT_NEAR(values[1].get<double>(), 10 * (1.25 + 4.0 / 6 + 12.0 / 6), 1e-4);
}

TEST(Pick, OfNothingIsNoHit) {
  Picker picker;
  picker.pick();
  picker.pick({1, 2, 3, 4});
  picker.workshop.steps(4);
  ASSERT_EQ(picker.answers.size(), 2u);
  EXPECT_EQ(picker.answers[0].found, (json{{"revision", 1}, {"hit", false}}));
  EXPECT_EQ(picker.answers[1].found, (json{{"revision", 1}, {"truncated", false}, {"hits", json::array()}}));
}

TEST(Pick, OfARectangleNamesEveryVoxelOnce) {
  Picker picker;
  picker.workshop.control->found = {picker.at({1, 1, 0}), picker.at({1.3, 0.8, 0}), picker.at({2, 1, 0})};
  picker.pick({0, 0, 31, 31});
  picker.pick({0, 0, 32, 31});
  picker.workshop.steps(4);
  ASSERT_EQ(picker.answers.size(), 2u);
  const json& found = picker.answers[0].found;
  ASSERT_EQ(found["hits"].size(), 2u);
  EXPECT_EQ(found["hits"][0]["point"], (json{1.0, 1.0, 0.0}));
  EXPECT_EQ(found["hits"][1]["voxel"], (json{2, 1, 0}));
  EXPECT_EQ(found["truncated"], false);
  EXPECT_EQ(picker.answers[1].found["truncated"], true);  // 33 x 32 pixels
}

TEST(Pick, NeedsNobodyWhoLooksAndNoPicture) {
  Picker picker;
  picker.workshop.step();
  EXPECT_EQ(picker.workshop.control->renderersMade, 0);
  picker.pick();
  picker.workshop.steps(3);
  EXPECT_EQ(picker.answers.size(), 1u);
  EXPECT_EQ(picker.workshop.control->picks, std::vector<std::uint32_t>{5});
  EXPECT_TRUE(picker.workshop.control->passes.empty());
}

TEST(Pick, IsOfTheSceneAsItIsNow) {
  Picker picker;
  picker.session->addViewer(std::make_shared<FakeViewer>());
  picker.workshop.steps(3);
  picker.session->patch(seedPatch(6), {});
  picker.pick();
  picker.workshop.step();
  ASSERT_EQ(picker.answers.size(), 1u);
  EXPECT_EQ(picker.answers[0].found["revision"], 2);
  EXPECT_EQ(picker.workshop.control->picks, std::vector<std::uint32_t>{6});
}

TEST(Pick, WaitsForTheSceneButNotForWhatElseIsDoneInTheBackground) {
  Picker picker;
  Workshop& workshop = picker.workshop;
  workshop.background.atOnce = false;
  picker.session->addViewer(std::make_shared<FakeViewer>());
  picker.pick();
  workshop.steps(3);
  EXPECT_TRUE(picker.answers.empty());  // the scene is being built
  workshop.background.finish();
  workshop.step();
  EXPECT_EQ(picker.answers.size(), 1u);
  workshop.control->longErrorFrom = 1;
  workshop.errors.atOnce = false;
  workshop.steps(3);
  ASSERT_EQ(workshop.errors.waiting.size(), 1u);  // the picture's error is being measured
  picker.pick();
  workshop.step();
  EXPECT_EQ(picker.answers.size(), 2u);
  EXPECT_EQ(workshop.errors.waiting.size(), 1u);
}

TEST(Pick, OutsideOfAPictureThatHasBecomeSmallerIsRefused) {
  Picker picker;
  EXPECT_THROW(picker.pick({600, 0}), ProtocolError);
  picker.pick({500, 0});
  picker.session->patch({{"image", {{"width", 100}}}}, {});
  picker.workshop.step();
  ASSERT_EQ(picker.answers.size(), 1u);
  try {
    std::rethrow_exception(picker.answers[0].failure);
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.pointer, "/x");
  }
}

TEST(Pick, IsToldThatTheSceneCannotBeRendered) {
  Picker picker;
  picker.workshop.control->failure = "macrocell: expected more memory";
  picker.pick();
  picker.workshop.step();
  ASSERT_EQ(picker.answers.size(), 1u);
  EXPECT_THROW(std::rethrow_exception(picker.answers[0].failure), Error);
  EXPECT_THROW(picker.pick(), Error);
  EXPECT_THROW(picker.session->waitForPick({1, 2}, 0ms), Error);
}

const std::pair<int, std::string> kPickFailed{500, "the server failed to answer this pick"};

TEST(Pick, ThatFailsSaysSoAndThePictureGoesOn) {
  Picker picker;
  Workshop& workshop = picker.workshop;
  const auto viewer = std::make_shared<FakeViewer>();
  picker.session->addViewer(viewer);
  workshop.steps(2);
  workshop.control->pickFailure = "a secret path";
  picker.pick();
  workshop.steps(2);
  ASSERT_EQ(picker.answers.size(), 1u);
  EXPECT_EQ(pickProblem(picker.answers[0]), kPickFailed);
  ASSERT_EQ(workshop.log.size(), 1u);
  EXPECT_NE(workshop.log[0].find("a secret path"), std::string::npos);
  EXPECT_TRUE(viewer->failures.empty());
  const auto passes = workshop.control->passes.size();
  workshop.control->pickFailure.clear();
  picker.pick();
  workshop.steps(4);
  EXPECT_GT(workshop.control->passes.size(), passes);
  ASSERT_EQ(picker.answers.size(), 2u);
  EXPECT_FALSE(picker.answers[1].failure);
}

/// The job that runs in the background when a pick fails.
enum class Beside { pass, addition, picture };

TEST(Pick, ThatFailsLetsABackgroundJobEndWell) {
  for (const Beside job : {Beside::pass, Beside::addition, Beside::picture}) {
    Picker picker;
    Workshop& workshop = picker.workshop;
    const auto viewer = std::make_shared<FakeViewer>();
    picker.session->addViewer(viewer);
    workshop.steps(2);
    FakeBackground& background = job == Beside::addition ? workshop.background
                                 : job == Beside::pass   ? workshop.passes
                                                         : workshop.errors;
    if (job == Beside::pass) {
      workshop.control->duringPass = [&] { workshop.clock.advance(1s); };
      workshop.step();
      workshop.control->duringPass = nullptr;
    }
    workshop.control->filmIsLarge = job == Beside::addition;
    workshop.control->longErrorFrom = job == Beside::picture ? 1 : ~0u;
    background.atOnce = false;
    workshop.steps(3);
    ASSERT_EQ(background.waiting.size(), 1u);
    workshop.control->pickFailure = "a bug";
    picker.pick();
    workshop.steps(2);
    ASSERT_EQ(picker.answers.size(), 1u);
    EXPECT_EQ(pickProblem(picker.answers[0]), kPickFailed);
    EXPECT_EQ(background.waiting.size(), 1u);
    background.finish();
    background.atOnce = true;
    const auto passes = workshop.control->passes.size();
    workshop.clock.advance(600ms);
    const auto frames = viewer->frames.size();
    workshop.steps(4);
    EXPECT_GT(workshop.control->passes.size(), passes);
    EXPECT_GT(viewer->frames.size(), frames);
    EXPECT_TRUE(viewer->failures.empty());
    EXPECT_EQ(workshop.control->renderersMade, 1);
  }
}

TEST(Pick, DelaysNobodyWhileItsAnswerIsWritten) {
  Picker picker;
  std::vector<std::future<std::size_t>> asked;
  int served = 0;
  const auto write = [&](const PickAnswer&) {
    asked.push_back(std::async(std::launch::async, [&] { return picker.session->viewerCount(); }));
    served += asked.back().wait_for(10s) == std::future_status::ready;
  };
  picker.session->pick({1, 2}, write);
  picker.workshop.step();
  picker.session->pick({1, 2}, write);
  picker.session->fail(1, Error(ErrorCode::busy, "no memory"));
  const ViewerId viewer = picker.session->addViewer(std::make_shared<FakeViewer>());
  picker.session->pick({1, 2}, write, viewer);
  picker.session->removeViewer(viewer);
  EXPECT_EQ(served, 3);
}

TEST(Pick, EndsWhenTheViewerThatAskedForItLeaves) {
  Picker picker;
  const ViewerId viewer = picker.session->addViewer(std::make_shared<FakeViewer>());
  picker.workshop.steps(2);
  picker.workshop.control->incompletePicks = 1000;
  for (int i = 0; i < 2; ++i)
    picker.session->pick(
        {1, 2}, [&](PickAnswer answer) { picker.answers.push_back(std::move(answer)); }, viewer);
  picker.workshop.step();
  bool othersAnswered = false;
  picker.session->pick({1, 2}, [&](const PickAnswer&) { othersAnswered = true; });
  picker.session->removeViewer(viewer);
  ASSERT_EQ(picker.answers.size(), 2u);
  for (const PickAnswer& answer : picker.answers) EXPECT_EQ(pickProblem(answer).first, 409);
  picker.workshop.control->incompletePicks = 0;
  picker.workshop.steps(2);
  EXPECT_TRUE(othersAnswered);
  EXPECT_FALSE(picker.session->request().wanted);
}

TEST(Pick, WhoseAnswerCannotBeTakenDisturbsNoOther) {
  Picker picker;
  const auto throws = [](const PickAnswer&) { throw std::runtime_error("no memory for this answer"); };
  picker.session->pick({1, 2}, throws);
  picker.pick();
  picker.workshop.steps(5);
  ASSERT_EQ(picker.answers.size(), 1u);
  EXPECT_FALSE(picker.answers[0].failure);
  picker.session->pick({1, 2}, throws);
  picker.pick();
  picker.session->fail(1, Error(ErrorCode::busy, "no memory"));
  ASSERT_EQ(picker.answers.size(), 2u);
  EXPECT_TRUE(picker.answers[1].failure);
}

TEST(Pick, OneTooManyIsRefusedWith429) {
  Picker picker;
  for (std::size_t i = 0; i < PickQueue::kMaxPicks; ++i) picker.pick();
  try {
    picker.pick();
    FAIL() << "no error";
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.status, 429);
  }
  // A pick whose wait has timed out makes room again.
  picker.workshop.steps(2 * int(PickQueue::kMaxPicks));
  EXPECT_EQ(picker.answers.size(), PickQueue::kMaxPicks);
  for (std::size_t i = 0; i <= PickQueue::kMaxPicks; ++i)
    EXPECT_FALSE(picker.session->waitForPick({1, 2}, 0ms).has_value());
}

TEST(Pick, WakesWhoWaits) {
  Picker picker;
  picker.workshop.control->found = {picker.at({2, 1, 1})};
  std::thread rendering([&] {
    while (!picker.session->request().pick) std::this_thread::yield();
    picker.workshop.step();
  });
  const auto found = picker.session->waitForPick({1, 2}, 60s);
  rendering.join();
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ((*found)["hit"], true);
  std::thread closing([&] {
    while (!picker.session->request().pick) std::this_thread::yield();
    picker.session->close("the end");
  });
  EXPECT_FALSE(picker.session->waitForPick({1, 2}, 60s).has_value());
  closing.join();
  EXPECT_THROW(picker.pick(), ProtocolError);
}

}  // namespace
}  // namespace scolopax::server
