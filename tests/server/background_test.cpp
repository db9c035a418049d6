// SPDX-License-Identifier: Apache-2.0
#include "server/background.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <vector>

#include "renderer/core/error.h"

namespace scolopax::server {
namespace {

/// During its lifetime no thread can be created: each would need a stack for which there is no room.
class NoThreads {
 public:
  NoThreads() {
    pthread_getattr_default_np(&before_);
    pthread_attr_t huge = before_;
    pthread_attr_setstacksize(&huge, std::size_t(1) << 50);
    pthread_setattr_default_np(&huge);
  }
  ~NoThreads() { pthread_setattr_default_np(&before_); }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  pthread_attr_t before_{};
};

TEST(BackgroundThreads, DoesTheWorkItselfWhenThereIsNoThread) {
  BackgroundThreads background;
  int worked = 0, ended = 0;
  {
    const NoThreads none;
    const auto job = background.start([&](const std::stop_token&) { ++worked; }, [&] { ++ended; });
    EXPECT_TRUE(job->done());
    const auto failing =
        background.start([](const std::stop_token&) { throw std::runtime_error("no"); }, [&] { ++ended; });
    EXPECT_THROW(failing->rethrow(), std::runtime_error);
  }
  EXPECT_EQ(worked, 1);
  EXPECT_EQ(ended, 2);
}

TEST(BackgroundThreads, OutlivesJobsThatEndWhileOthersBegin) {
  std::atomic<int> worked{0};
  std::vector<std::shared_ptr<Background::Job>> jobs;
  {
    BackgroundThreads background;
    for (int i = 0; i < 2000; ++i)
      jobs.push_back(background.start([&](const std::stop_token&) { ++worked; }, [] {}));
  }
  int left = 0;
  for (const auto& job : jobs) {
    ASSERT_TRUE(job->done());
    try {
      job->rethrow();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled);
      ++left;
    }
  }
  EXPECT_EQ(worked + left, 2000);
}

/// Jobs that end when they are told to.
struct HeldJobs {
  std::mutex mutex;
  std::condition_variable changed;
  int begun = 0, atOnce = 0, mostAtOnce = 0, ended = 0, allowed = 0;
  BackgroundThreads background{2};

  std::shared_ptr<Background::Job> start() {
    return background.start(
        [this](const std::stop_token&) {
          std::unique_lock lock(mutex);
          const int number = begun++;
          mostAtOnce = std::max(mostAtOnce, ++atOnce);
          changed.notify_all();
          changed.wait(lock, [&] { return number < allowed; });
          --atOnce;
        },
        [this] {
          const std::lock_guard lock(mutex);
          ++ended;
          changed.notify_all();
        });
  }
  void allow(int count) {
    const std::lock_guard lock(mutex);
    allowed = count;
    changed.notify_all();
  }
  void waitFor(const int& value, int count) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return value == count; });
  }
};

TEST(BackgroundThreads, RunsAsManyJobsAtOnceAsItMayAndTheOthersAfterThem) {
  HeldJobs jobs;
  std::vector<std::shared_ptr<Background::Job>> started;
  for (int i = 0; i < 5; ++i) started.push_back(jobs.start());
  for (int done = 0; done < 5; ++done) {
    jobs.waitFor(jobs.begun, std::min(done + 2, 5));
    jobs.allow(done + 1);
    jobs.waitFor(jobs.ended, done + 1);
  }
  EXPECT_EQ(jobs.mostAtOnce, 2);
  for (const auto& job : started) EXPECT_TRUE(job->done());
}

TEST(BackgroundThreads, EndsAJobAtOnceThatIsCancelledWhileItWaits) {
  HeldJobs jobs;
  const auto first = jobs.start(), second = jobs.start();
  jobs.waitFor(jobs.begun, 2);
  const auto third = jobs.start(), fourth = jobs.start();
  third->cancel();
  EXPECT_TRUE(third->done());
  EXPECT_EQ(jobs.ended, 1);
  EXPECT_THROW(third->rethrow(), Error);
  EXPECT_FALSE(fourth->done());
  jobs.allow(3);
  jobs.waitFor(jobs.ended, 4);
  EXPECT_EQ(jobs.begun, 3);
}

}  // namespace
}  // namespace scolopax::server
