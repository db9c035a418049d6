// SPDX-License-Identifier: Apache-2.0
#include "server/volume_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "renderer/core/error.h"
#include "tests/server/fakes.h"

namespace scolopax::server {
namespace {

constexpr std::uint64_t kBytes = 48;  // of smallVolume(): 2 channels of 24 voxels

class VolumeCacheTest : public ::testing::Test {
 protected:
  VolumeCache::Wanted wanted(std::size_t time, std::uint64_t bytes = kBytes) {
    return {{this, time}, "small", bytes, [this](const io::LoadOptions&) {
              ++loads_;
              return testing::smallVolume();
            }};
  }

  std::atomic<int> loads_ = 0;
  VolumeCache cache_{3 * kBytes};
};

ErrorCode codeOf(const std::function<void()>& work, std::string* message = nullptr) {
  try {
    work();
  } catch (const Error& error) {
    if (message) *message = error.what();
    return error.code();
  }
  ADD_FAILURE() << "expected an Error";
  return ErrorCode::io;
}

TEST_F(VolumeCacheTest, LoadsOnceAndKeepsWhatNobodyUses) {
  EXPECT_EQ(cache_.find({this, 0}), nullptr);
  const Volume* volume = cache_.get(wanted(0), {}).get();
  EXPECT_EQ(cache_.get(wanted(0), {}).get(), volume);
  EXPECT_EQ(cache_.find({this, 0}).get(), volume);
  EXPECT_EQ(loads_, 1);
  EXPECT_EQ(cache_.usedBytes(), kBytes);
}

TEST_F(VolumeCacheTest, DropsTheLeastRecentlyUsed) {
  for (std::size_t time = 0; time < 3; ++time) cache_.get(wanted(time), {});
  cache_.find({this, 0});  // now 1 is the one used longest ago
  cache_.get(wanted(3), {});
  EXPECT_TRUE(cache_.holds({this, 0}));
  EXPECT_FALSE(cache_.holds({this, 1}));
  EXPECT_TRUE(cache_.holds({this, 2}));
  EXPECT_EQ(cache_.usedBytes(), 3 * kBytes);
}

TEST_F(VolumeCacheTest, NeverDropsWhatIsUsed) {
  std::vector<std::shared_ptr<const Volume>> used;
  for (std::size_t time = 0; time < 3; ++time) used.push_back(cache_.get(wanted(time), {}));
  std::string message;
  EXPECT_EQ(codeOf([&] { cache_.get(wanted(3), {}); }, &message), ErrorCode::busy);
  EXPECT_NE(message.find("small: needs 48 bytes"), std::string::npos) << message;
  EXPECT_NE(message.find("144 bytes"), std::string::npos) << message;
  EXPECT_EQ(loads_, 3) << "nothing is read in vain";
  used.erase(used.begin() + 1);
  cache_.get(wanted(3), {});
  EXPECT_FALSE(cache_.holds({this, 1}));
}

TEST_F(VolumeCacheTest, RefusesWhatNeverFitsBeforeReadingIt) {
  std::string message;
  EXPECT_EQ(codeOf([&] { cache_.get(wanted(0, 3 * kBytes + 1), {}); }, &message), ErrorCode::tooLarge);
  EXPECT_NE(message.find("small: needs 145 bytes"), std::string::npos) << message;
  EXPECT_EQ(loads_, 0);
}

/// Keeps volumes without using them.
struct Keepers {
  std::vector<std::shared_ptr<const Volume>> kept;

  VolumeCache::Resting resting() {
    const auto volumes = [this] {
      std::vector<const Volume*> all;
      for (const auto& volume : kept) all.push_back(volume.get());
      return all;
    };
    const auto release = [this] {
      if (kept.empty()) return false;
      kept.pop_back();
      return true;
    };
    return {volumes, release};
  }
};

TEST_F(VolumeCacheTest, AsksForTheReleaseOfWhatIsUsedNeedlessly) {
  Keepers keepers;
  for (std::size_t time = 0; time < 3; ++time) keepers.kept.push_back(cache_.get(wanted(time), {}));
  cache_.setResting(keepers.resting());
  cache_.get(wanted(3), {});
  EXPECT_EQ(keepers.kept.size(), 2u) << "no more is released than is needed";
}

TEST_F(VolumeCacheTest, ReleasesNothingForALoadThatWouldNotFitEvenThen) {
  Keepers keepers;
  const auto used = cache_.get(wanted(0), {});
  for (std::size_t time = 1; time < 3; ++time) keepers.kept.push_back(cache_.get(wanted(time), {}));
  cache_.setResting(keepers.resting());
  EXPECT_EQ(codeOf([&] { cache_.get(wanted(3, 3 * kBytes), {}); }), ErrorCode::busy);
  EXPECT_EQ(keepers.kept.size(), 2u);
  EXPECT_NE(cache_.get(wanted(4, 2 * kBytes), {}), nullptr);
}

TEST_F(VolumeCacheTest, LoadsInAdvanceOnlyWhereOlderUsesGiveWay) {
  for (std::size_t time = 0; time < 3; ++time) cache_.get(wanted(time), {});
  const std::uint64_t before = cache_.uses() + 1;
  for (std::size_t time = 1; time < 3; ++time) cache_.find({this, time});
  EXPECT_NE(cache_.getIfRoom(wanted(3), before, {}), nullptr);
  EXPECT_FALSE(cache_.holds({this, 0}));
  EXPECT_EQ(cache_.getIfRoom(wanted(4), before, {}), nullptr);
  for (std::size_t time = 1; time < 4; ++time) EXPECT_TRUE(cache_.holds({this, time})) << time;
}

TEST_F(VolumeCacheTest, SharesALoadAndTellsItsProgress) {
  std::promise<void> go;
  const auto gone = go.get_future().share();
  std::promise<void> begun;
  VolumeCache::Wanted slow = wanted(7);
  slow.load = [&](const io::LoadOptions& options) {
    ++loads_;
    options.progress({"reading", 10, 48});
    begun.set_value();
    gone.wait();
    return testing::smallVolume();
  };
  auto first = std::async(std::launch::async, [&] { return cache_.get(slow, {}); });
  begun.get_future().wait();
  const auto progress = cache_.progress(this);
  ASSERT_TRUE(progress);
  EXPECT_EQ(progress->time, 7u);
  EXPECT_EQ(progress->stage, "reading");
  EXPECT_EQ(progress->doneBytes, 10u);
  EXPECT_EQ(progress->allBytes, 48u);
  EXPECT_EQ(cache_.usedBytes(), kBytes) << "what is promised to a load counts";
  auto second = std::async(std::launch::async, [&] { return cache_.get(slow, {}); });
  go.set_value();
  EXPECT_EQ(first.get(), second.get());
  EXPECT_EQ(loads_, 1);
  EXPECT_FALSE(cache_.progress(this));
}

/// A load that goes on until it is cancelled, or until `go`.
struct LongLoad {
  std::promise<void> begun;
  std::atomic<bool> go = false, cancelled = false;

  VolumeCache::Wanted of(VolumeCache::Wanted wanted) {
    wanted.load = [this](const io::LoadOptions& options) -> std::shared_ptr<const Volume> {
      begun.set_value();
      while (!go && !options.stop.stop_requested()) {
        options.progress({"reading", 1, 2});
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      cancelled = options.stop.stop_requested();
      if (cancelled) throw Error(ErrorCode::cancelled, "cancelled");
      return testing::smallVolume();
    };
    return wanted;
  }
  /// Asks for it, and leaves once it has begun.
  void abandon(VolumeCache& cache, const VolumeCache::Wanted& wanted) {
    std::stop_source stop;
    auto waiting =
        std::async(std::launch::async, [&] { return codeOf([&] { cache.get(wanted, stop.get_token()); }); });
    begun.get_future().wait();
    stop.request_stop();
    EXPECT_EQ(waiting.get(), ErrorCode::cancelled);
  }
};

TEST_F(VolumeCacheTest, EndsALoadThatNobodyWaitsForAnyMore) {
  LongLoad load;
  VolumeCache cache(3 * kBytes, {}, std::chrono::milliseconds(0));
  load.abandon(cache, load.of(wanted(0)));
  while (cache.usedBytes() > 0) std::this_thread::yield();
  EXPECT_TRUE(load.cancelled);
  EXPECT_NE(cache.get(wanted(0), {}), nullptr) << "it can be loaded later";
}

TEST_F(VolumeCacheTest, GoesOnWithALoadForAWhileSoThatOneWhoAsksAgainGetsIt) {
  LongLoad load;
  VolumeCache cache(3 * kBytes, {}, std::chrono::hours(1));
  load.abandon(cache, load.of(wanted(0)));
  auto again = std::async(std::launch::async, [&] { return cache.get(wanted(0), {}); });
  load.go = true;
  EXPECT_NE(again.get(), nullptr);
  EXPECT_FALSE(load.cancelled);
  EXPECT_EQ(loads_, 0) << "the first load has served it";
}

TEST_F(VolumeCacheTest, EndsALoadThatNobodyWaitsForWhenItsMemoryIsNeeded) {
  LongLoad load;
  VolumeCache cache(kBytes, {}, std::chrono::hours(1));
  load.abandon(cache, load.of(wanted(0)));
  EXPECT_NE(cache.get(wanted(1), {}), nullptr);
  EXPECT_TRUE(load.cancelled);
}

TEST_F(VolumeCacheTest, EndsItsLoadsWhenItEnds) {
  LongLoad load;
  {
    VolumeCache cache(kBytes, {}, std::chrono::hours(1));
    load.abandon(cache, load.of(wanted(0)));
  }
  EXPECT_TRUE(load.cancelled);
}

TEST_F(VolumeCacheTest, HasOneLoadAtMostThatNobodyWaitsFor) {
  LongLoad first, second;
  VolumeCache cache(3 * kBytes, {}, std::chrono::hours(1));
  first.abandon(cache, first.of(wanted(0)));
  second.abandon(cache, second.of(wanted(1)));
  while (cache.usedBytes() > kBytes) std::this_thread::yield();
  EXPECT_TRUE(first.cancelled);
  second.go = true;
}

TEST_F(VolumeCacheTest, DropsTheVolumeThatWasLoadedLast) {
  for (std::size_t time = 0; time < 20; ++time) EXPECT_NE(cache_.get(wanted(time), {}), nullptr);
  EXPECT_EQ(loads_, 20) << "none was refused at first";
  VolumeCache one(kBytes);
  for (std::size_t time = 0; time < 5; ++time) {
    bool asked = false;
    one.setResting({[] { return std::vector<const Volume*>{}; }, [&] { return asked = true, false; }});
    EXPECT_NE(one.get(wanted(time), {}), nullptr);
    EXPECT_FALSE(asked) << "nothing else has to give way";
  }
}

TEST_F(VolumeCacheTest, BeginsNoLoadForACallerWhoHasLeft) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(codeOf([&] { cache_.get(wanted(0), stop.get_token()); }), ErrorCode::cancelled);
  EXPECT_EQ(loads_, 0);
}

TEST_F(VolumeCacheTest, GivesItsRoomBackWhenALoadFails) {
  VolumeCache::Wanted broken = wanted(0);
  broken.load = [](const io::LoadOptions&) -> std::shared_ptr<const Volume> {
    throw Error(ErrorCode::badInput, "damaged");
  };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(codeOf([&] { cache_.get(broken, {}); }), ErrorCode::badInput);
  EXPECT_EQ(cache_.usedBytes(), 0u);
}

TEST_F(VolumeCacheTest, KeepsWhatIsAttachedAsLongAsTheVolume) {
  const auto attached = std::make_shared<int>(1);
  cache_.get(wanted(0), {});
  cache_.attach({this, 0}, attached);
  EXPECT_EQ(attached.use_count(), 2);
  for (std::size_t time = 1; time < 4; ++time) cache_.get(wanted(time), {});
  EXPECT_EQ(attached.use_count(), 1);
}

}  // namespace
}  // namespace scolopax::server
