// SPDX-License-Identifier: Apache-2.0
#include "server/background.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>

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
  {
    BackgroundThreads background;
    for (int i = 0; i < 2000; ++i) background.start([&](const std::stop_token&) { ++worked; }, [] {});
  }
  EXPECT_EQ(worked, 2000);
}

}  // namespace
}  // namespace scolopax::server
