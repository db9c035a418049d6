// SPDX-License-Identifier: Apache-2.0
#include "server/background.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/core/shared_builds.h"
#include "tests/server/net/gate.h"

namespace scolopax::server {
namespace {

using net::eventually;
using net::Gate;
using Jobs = std::vector<std::shared_ptr<Background::Job>>;

Background::Work passing(Gate& gate) {
  return [&gate](const std::stop_token&) { gate.pass(); };
}

/// Records the order in which jobs run.
class Notes {
 public:
  Background::Work job(const std::string& name) {
    return [this, name](const std::stop_token&) {
      const std::lock_guard lock(mutex_);
      names_.push_back(name);
    };
  }
  std::vector<std::string> names() {
    const std::lock_guard lock(mutex_);
    return names_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> names_;
};

/// While it exists, no thread can be created, because there is no room for a stack.
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
    const auto job = background.start(
        "a", [&](const std::stop_token&) { ++worked; }, [&] { ++ended; });
    EXPECT_TRUE(job->done());
    const auto failing = background.start(
        "a", [](const std::stop_token&) { throw std::runtime_error("no"); }, [&] { ++ended; });
    EXPECT_THROW(failing->rethrow(), std::runtime_error);
  }
  EXPECT_EQ(worked, 1);
  EXPECT_EQ(ended, 2);
}

TEST(BackgroundThreads, OutlivesJobsThatEndWhileOthersBegin) {
  std::atomic<int> worked{0};
  Jobs jobs;
  {
    BackgroundThreads background;
    for (int i = 0; i < 2000; ++i)
      jobs.push_back(background.start(
          std::to_string(i % 3), [&](const std::stop_token&) { ++worked; }, [] {}));
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

/// Jobs that end when the test ends them.
struct HeldJobs {
  std::mutex mutex;
  std::condition_variable changed;
  int begun = 0, atOnce = 0, mostAtOnce = 0, ended = 0, allowed = 0, started = 0;
  BackgroundThreads background{2};

  std::shared_ptr<Background::Job> start() {
    return background.start(
        std::to_string(started++),
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
  Jobs started;
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

TEST(BackgroundThreads, LetSessionsTakeTurns) {
  Gate gate;
  Notes notes;
  BackgroundThreads background(1);
  background.start("z", passing(gate), [] {});
  gate.waitFor(1);
  Jobs jobs;
  for (const char* name : {"a1", "a2", "a3", "b1", "b2", "c1"})
    jobs.push_back(background.start({name[0]}, notes.job(name), [] {}));
  jobs[1]->cancel();
  gate.open();
  for (const auto& job : jobs) job->wait();
  EXPECT_EQ(notes.names(), (std::vector<std::string>{"a1", "b1", "c1", "a3", "b2"}));
}

TEST(BackgroundThreads, GiveASessionAtMostHalfOfThePlaces) {
  Gate gate;
  Notes notes;
  BackgroundThreads background(4);
  for (int i = 0; i < 10; ++i) background.start("a", passing(gate), [] {});
  gate.waitFor(2);
  Jobs jobs;
  for (const char* name : {"b", "c", "d"}) jobs.push_back(background.start(name, notes.job(name), [] {}));
  for (const auto& job : jobs) job->wait();
  EXPECT_EQ(gate.arrived(), 2);
  gate.open();
}

TEST(BackgroundThreads, WorkForOthersWhileJobsWaitForABuild) {
  SharedBuilds<int, int> builds;
  Gate built, busy;
  std::mutex mutex;
  int asking = 0, working = 0, mostWorking = 0;
  BackgroundThreads background(1);
  Jobs jobs;
  for (int i = 0; i < 5; ++i)
    jobs.push_back(background.start(
        std::to_string(i % 2),
        [&](const std::stop_token& stop) {
          {
            const std::lock_guard lock(mutex);
            ++asking;
          }
          builds.get(
              0,
              [&](const std::stop_token&) {
                built.pass();
                return std::make_shared<const int>(0);
              },
              stop);
          {
            const std::lock_guard lock(mutex);
            mostWorking = std::max(mostWorking, ++working);
          }
          busy.pass();
          const std::lock_guard lock(mutex);
          --working;
        },
        [] {}));
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return asking == 5;
  }));
  int others = 0;
  background.run("other", {}, [&](const std::stop_token&) { ++others; });
  EXPECT_EQ(others, 1);
  EXPECT_EQ(built.arrived(), 1);
  // Afterwards they work one at a time.
  built.open();
  busy.waitFor(1);
  busy.open();
  for (const auto& job : jobs) job->wait();
  EXPECT_EQ(mostWorking, 1);
}

TEST(BackgroundThreads, EndAJobThatIsCancelledWhileItWaitsForABuildThoughItsPlaceIsTaken) {
  SharedBuilds<int, int> builds;
  Gate busy;
  BackgroundThreads background(1);
  const auto waiting = background.start(
      "a",
      [&](const std::stop_token& stop) {
        builds.get(
            0,
            [](const std::stop_token& abandoned) {
              eventually([&] { return abandoned.stop_requested(); });
              return std::make_shared<const int>(0);
            },
            stop);
      },
      [] {});
  background.start("b", passing(busy), [] {});
  busy.waitFor(1);
  waiting->cancel();
  waiting->wait();
  EXPECT_THROW(waiting->rethrow(), Error);
  busy.open();
}

TEST(BackgroundThreads, RunForAThreadThatWaits) {
  BackgroundThreads background(1);
  int worked = 0;
  background.run("a", {}, [&](const std::stop_token&) { ++worked; });
  EXPECT_EQ(worked, 1);
  EXPECT_THROW(background.run("a", {}, [](const std::stop_token&) { throw std::runtime_error("no"); }),
               std::runtime_error);
  std::stop_source stop;
  EXPECT_FALSE(stop.stop_requested());
  background.run("a", stop.get_token(), [&](const std::stop_token& cancelled) {
    stop.request_stop();
    worked += eventually([&] { return cancelled.stop_requested(); });
  });
  EXPECT_EQ(worked, 2);
  EXPECT_THROW(background.run("a", stop.get_token(), [&](const std::stop_token&) { ++worked; }), Error);
  EXPECT_EQ(worked, 2);
}

TEST(BackgroundThreads, LetAThreadGoThatNoLongerWaitsForItsTurn) {
  Gate gate;
  BackgroundThreads background(1);
  background.start("z", passing(gate), [] {});
  gate.waitFor(1);
  std::stop_source stop;
  bool worked = false;
  {
    const std::jthread waiting([&] {
      EXPECT_THROW(background.run("a", stop.get_token(), [&](const std::stop_token&) { worked = true; }),
                   Error);
    });
    stop.request_stop();
  }
  EXPECT_FALSE(worked);
  gate.open();
}

TEST(BackgroundThreads, WorkAtLowPriority) {
  BackgroundThreads background(1);
  background.run("a", {}, [](const std::stop_token&) { EXPECT_GT(getpriority(PRIO_PROCESS, 0), 0); });
}

}  // namespace
}  // namespace scolopax::server
