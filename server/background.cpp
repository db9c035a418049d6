// SPDX-License-Identifier: Apache-2.0
#include "server/background.h"

#include <exception>
#include <system_error>
#include <utility>

#include "renderer/core/error.h"
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

void Background::Job::leave() {
  work_ = nullptr;
  promise_.set_exception(
      std::make_exception_ptr(Error(ErrorCode::cancelled, "cancelled before its turn came")));
}

BackgroundThreads::~BackgroundThreads() {
  std::list<std::shared_ptr<Job>> jobs;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    for (const auto* entries : {&waiting_, &running_})
      for (const Entry& entry : *entries) jobs.push_back(entry.job);
  }
  for (const auto& job : jobs) job->cancel();
  came_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

std::shared_ptr<Background::Job> BackgroundThreads::start(Work work, std::function<void()> ended) {
  auto job = std::make_shared<Job>(std::move(work));
  {
    const std::lock_guard lock(mutex_);
    if (idle_ <= waiting_.size() && threads_.size() < mostAtOnce_) startThread();
    if (!threads_.empty()) {
      Entry& entry = waiting_.emplace_back();
      entry.job = job;
      entry.ended = std::move(ended);
      entry.onCancel.emplace(job->cancelled(), [this, &which = *job] { leave(which); });
      came_.notify_one();
      return job;
    }
  }
  job->run();
  ended();
  return job;
}

void BackgroundThreads::startThread() {
  try {
    threads_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {  // the threads that there are do the work
  }
}

void BackgroundThreads::work() {
  lowerThreadPriority();
  std::unique_lock lock(mutex_);
  for (;;) {
    ++idle_;
    came_.wait(lock, [&] { return ending_ || !waiting_.empty(); });
    --idle_;
    if (waiting_.empty()) return;
    const auto entry = waiting_.begin();
    running_.splice(running_.end(), waiting_, entry);
    lock.unlock();
    entry->onCancel.reset();
    entry->job->run();
    entry->ended();
    std::list<Entry> over;
    lock.lock();
    over.splice(over.end(), running_, entry);
    lock.unlock();
    over.clear();
    lock.lock();
  }
}

/// Ends a job that waits.
void BackgroundThreads::leave(const Job& job) {
  std::list<Entry> left;
  {
    const std::lock_guard lock(mutex_);
    const auto entry = std::find_if(waiting_.begin(), waiting_.end(),
                                    [&](const Entry& one) { return one.job.get() == &job; });
    if (entry == waiting_.end()) return;
    left.splice(left.end(), waiting_, entry);
  }
  left.front().job->leave();
  left.front().ended();
}

}  // namespace scolopax::server
