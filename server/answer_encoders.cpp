// SPDX-License-Identifier: Apache-2.0
#include "server/answer_encoders.h"

#include <algorithm>
#include <thread>

#include "renderer/core/error.h"
#include "renderer/core/thread_priority.h"

namespace scolopax::server {
namespace {

constexpr unsigned kMostThreads = 2;

}  // namespace

AnswerEncoders::AnswerEncoders()
    : pool_(int(std::clamp(std::thread::hardware_concurrency(), 1u, kMostThreads)), lowerThreadPriority) {}

void AnswerEncoders::run(const std::string& flow, const std::stop_token& stop,
                         const std::function<void()>& encode) {
  net::FairPool::Job job([&] {
    if (stop.stop_requested())
      throw Error(ErrorCode::cancelled, "encoding cancelled: its result is no longer needed");
    encode();
  });
  auto done = job.get_future();
  pool_.post(flow, std::move(job));
  done.get();
}

}  // namespace scolopax::server
