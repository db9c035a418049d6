// SPDX-License-Identifier: Apache-2.0
#include "server/answer_encoders.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <mutex>
#include <thread>
#include <vector>

#include "renderer/core/error.h"
#include "tests/server/net/gate.h"

namespace scolopax::server {
namespace {

using net::Gate;

const int kAtOnce = std::thread::hardware_concurrency() > 1 ? 2 : 1;

TEST(AnswerEncoders, EncodeAtMostTwoPicturesAtOnceAtLowPriority) {
  AnswerEncoders encoders;
  Gate gate;
  std::mutex mutex;
  int running = 0, most = 0, encoded = 0;
  std::vector<std::jthread> requests;
  for (int i = 0; i < 6; ++i)
    requests.emplace_back([&, i] {
      encoders.run(std::to_string(i), {}, [&] {
        {
          const std::lock_guard lock(mutex);
          most = std::max(most, ++running);
        }
        gate.pass();
        EXPECT_GT(getpriority(PRIO_PROCESS, 0), 0);
        const std::lock_guard lock(mutex);
        --running, ++encoded;
      });
    });
  gate.waitFor(kAtOnce);
  gate.open();
  requests.clear();
  EXPECT_EQ(most, kAtOnce);
  EXPECT_EQ(encoded, 6);
}

TEST(AnswerEncoders, LetSessionsTakeTurns) {
  if (kAtOnce < 2) GTEST_SKIP() << "needs two processors";
  AnswerEncoders encoders;
  Gate gate;
  std::vector<std::jthread> requests;
  for (int i = 0; i < 5; ++i) requests.emplace_back([&] { encoders.run("a", {}, [&] { gate.pass(); }); });
  gate.waitFor(1);
  bool encoded = false;
  encoders.run("b", {}, [&] { encoded = true; });
  EXPECT_TRUE(encoded);
  EXPECT_EQ(gate.arrived(), 1);
  gate.open();
}

TEST(AnswerEncoders, DoNotBeginAPictureThatNobodyWants) {
  AnswerEncoders encoders;
  std::stop_source stop;
  stop.request_stop();
  bool encoded = false;
  EXPECT_THROW(encoders.run("", stop.get_token(), [&] { encoded = true; }), Error);
  EXPECT_FALSE(encoded);
}

TEST(AnswerEncoders, PassOnWhatEncodingThrows) {
  AnswerEncoders encoders;
  EXPECT_THROW(encoders.run("", {}, [] { throw std::runtime_error("no"); }), std::runtime_error);
}

}  // namespace
}  // namespace scolopax::server
