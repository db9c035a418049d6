// SPDX-License-Identifier: Apache-2.0
#include "server/prefetch.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "protocol/problem.h"
#include "renderer/core/error.h"
#include "renderer/io/datasets.h"
#include "server/dataset_store.h"
#include "server/scene_resolver.h"

namespace scolopax::server {
namespace {

using Steps = std::vector<std::size_t>;

TEST(StepsAround, FollowTheDirectionOfPlayAndBeginAgainAtTheEnd) {
  EXPECT_EQ(stepsAround(0, 10, false, 5), (Steps{1, 2, 9, 3, 4}));
  EXPECT_EQ(stepsAround(8, 10, false, 4), (Steps{9, 0, 7, 1}));
  EXPECT_EQ(stepsAround(1, 10, true, 4), (Steps{0, 9, 2, 8}));
}

TEST(StepsAround, AreEachThereOnceAndNeverTheStepItself) {
  for (std::size_t times = 1; times < 8; ++times)
    for (std::size_t time = 0; time < times; ++time)
      for (const bool backwards : {false, true}) {
        Steps steps = stepsAround(time, times, backwards, 100);
        EXPECT_EQ(steps.size(), times - 1);
        std::ranges::sort(steps);
        EXPECT_TRUE(std::ranges::adjacent_find(steps) == steps.end());
        EXPECT_TRUE(std::ranges::find(steps, time) == steps.end());
        EXPECT_EQ(stepsAround(time, times, backwards, 2).size(), std::min<std::size_t>(2, times - 1));
      }
}

/// Data sets of 16 voxels and 6 steps, whose bytes are all their step.
class TimeSeries : public ::testing::Test {
 protected:
  TimeSeries() {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("scolopax_series_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::ofstream file(folder_ / "series.nrrd", std::ios::binary);
    file << "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 4 2 2 6\nkinds: domain domain domain time\n"
            "encoding: raw\n\n";
    for (char step = 0; step < 6; ++step) file << std::string(16, step);
  }
  ~TimeSeries() override { std::filesystem::remove_all(folder_); }

  std::shared_ptr<const DatasetStore> storeOf(std::uint64_t limitBytes) {
    const std::filesystem::path path = folder_ / "series.nrrd";
    return std::make_shared<const DatasetStore>(io::openDatasets({&path, 1}),
                                                std::make_shared<VolumeCache>(limitBytes));
  }
  /// Waits until the step is in memory, for at most ten seconds.
  static bool comes(const DatasetStore& store, std::size_t time) {
    for (int i = 0; i < 1000; ++i) {
      if (store.cache()->holds({store.first().get(), time})) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  std::filesystem::path folder_;
};

TEST_F(TimeSeries, IsLoadedStepByStep) {
  const auto store = storeOf(1000);
  const Dataset& dataset = *store->first();
  EXPECT_EQ(dataset.times(), 6u);
  EXPECT_EQ(dataset.memoryBytes(), 16u);
  EXPECT_EQ(dataset.facts(), nullptr);
  for (const std::size_t time : {2, 5})
    EXPECT_EQ(dataset.load(time)->channels()[0].histogram.maximum, double(time));
  EXPECT_EQ(store->cache()->usedBytes(), 32u);
  EXPECT_EQ(dataset.facts()->time, 2u) << "that of the step loaded first";
  EXPECT_EQ(dataset.facts()->volume.channels[0].histogram.maximum, 2);
}

TEST_F(TimeSeries, KeepsItsRangesWhenTheTimeOrTheMemoryChanges) {
  const auto store = storeOf(16);  // one step at a time
  const SceneResolver resolver(store, {1'000'000});
  const auto first = resolver.replace({{"time", 3}});
  EXPECT_EQ(first->time, 3u);
  const auto later = resolver.patch(*first, {{"time", 5}});
  EXPECT_EQ(later->time, 5u);
  EXPECT_EQ(later->resolved.channels[0].range, first->resolved.channels[0].range);
  EXPECT_EQ(later->resolved.camera, first->resolved.camera);
  EXPECT_FALSE(makeSameFilm(*first, *later));
  later->dataset->load(5);
  EXPECT_FALSE(store->cache()->holds({store->first().get(), 3}));
  EXPECT_EQ(first->dataset->load(3)->channels()[0].histogram.maximum, 3) << "it is loaded again";
}

TEST_F(TimeSeries, IsMeasuredAtTheStepThatIsShownIfThereIsNoRoomForAnother) {
  const auto store = storeOf(16);
  store->first()->load(2);
  const auto shown = store->first()->load(3);
  EXPECT_EQ(store->first()->facts()->time, 2u);
  EXPECT_NE(store->measuredGradients(*store->first(), 0, {}), nullptr);
}

TEST_F(TimeSeries, NeedsItsDataToBeLoadedBeforeAScene) {
  const SceneResolver resolver(storeOf(1000), {1'000'000});
  EXPECT_THROW(resolver.replaceNow({{"time", 1}}), Unmeasured);
}

TEST_F(TimeSeries, HasNoOtherStepsThanItsOwn) {
  const SceneResolver resolver(storeOf(1000), {1'000'000});
  try {
    resolver.replace({{"time", 6}});
    FAIL();
  } catch (const protocol::ProtocolError& error) {
    EXPECT_EQ(error.status, 422);
    EXPECT_EQ(error.pointer, "/time");
    EXPECT_STREQ(error.what(), "time: expected 0 to 5, found 6");
  }
}

TEST_F(TimeSeries, CanBeLoadedWhenItIsServedNoLonger) {
  auto store = storeOf(1000);
  const VolumeCache::Wanted wanted = store->first()->wanted(4);
  store.reset();
  EXPECT_EQ(wanted.load({})->channels()[0].histogram.maximum, 4);
}

TEST_F(TimeSeries, IsLoadedInAdvanceInTheDirectionOfPlay) {
  const auto store = storeOf(1000);
  Prefetch prefetch(nullptr);
  store->first()->load(0);
  prefetch.around(store->first(), 0, 4);
  for (const std::size_t time : {1, 2, 3, 4, 5}) EXPECT_TRUE(comes(*store, time)) << time;
}

TEST_F(TimeSeries, LeavesAQuarterOfTheMemoryToOthersWhenLoadedInAdvance) {
  const auto store = storeOf(4 * 16);
  Prefetch prefetch(nullptr);
  for (const std::size_t time : {1, 2, 3}) {
    store->first()->load(time);
    prefetch.around(store->first(), time, 4);
    EXPECT_TRUE(comes(*store, time + 1));
    EXPECT_TRUE(comes(*store, time + 2));
    EXPECT_LE(store->cache()->usedBytes(), 4 * 16u);
  }
}

}  // namespace
}  // namespace scolopax::server
