// SPDX-License-Identifier: Apache-2.0
#include "server/background.h"

#include <exception>
#include <utility>

#include "renderer/core/thread_priority.h"

namespace scolopax::server {

bool Background::Job::done() const {
  return result_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

void Background::Job::run() {
  std::exception_ptr failure;
  try {
    work_(stop_.get_token());
  } catch (...) {
    failure = std::current_exception();
  }
  work_ = nullptr;
  if (failure)
    promise_.set_exception(failure);
  else
    promise_.set_value();
}

BackgroundThreads::~BackgroundThreads() {
  for (Running& one : running_) one.job->cancel();
  for (Running& one : running_) one.thread.join();
}

std::shared_ptr<Background::Job> BackgroundThreads::start(Work work, std::function<void()> ended) {
  auto job = std::make_shared<Job>(std::move(work));
  if (!startThread(job, ended)) {
    job->run();
    ended();
  }
  return job;
}

bool BackgroundThreads::startThread(const std::shared_ptr<Job>& job, const std::function<void()>& ended) {
  const std::lock_guard lock(mutex_);
  running_.remove_if([](Running& one) {
    if (!one.over) return false;
    one.thread.join();
    return true;
  });
  Running& one = running_.emplace_back();
  one.job = job;
  try {
    one.thread = std::thread([&one, job, ended] {
      lowerThreadPriority();
      job->run();
      ended();
      one.over = true;
    });
  } catch (const std::exception&) {
    running_.pop_back();
    return false;
  }
  return true;
}

}  // namespace scolopax::server
