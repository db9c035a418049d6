// SPDX-License-Identifier: Apache-2.0
#include "server/background.h"

#include <exception>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/core/thread_priority.h"
#include "renderer/core/wait_hooks.h"

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

void Background::Job::skip() {
  work_ = nullptr;
  promise_.set_exception(
      std::make_exception_ptr(Error(ErrorCode::cancelled, "cancelled before its turn came")));
}

void Background::run(const std::string& flow, const std::stop_token& stop, Work work) {
  if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "cancelled: its result is no longer needed");
  const auto job = start(flow, std::move(work), [] {});
  const std::stop_callback stopped(stop, [&] { job->cancel(); });
  job->wait();
  job->rethrow();
}

/// The slot of a running job, which the job gives up while it waits for a build.
class BackgroundThreads::RunningSlot final : public WaitHooks {
 public:
  RunningSlot(BackgroundThreads& pool, const std::string& flow, const Job& job)
      : pool_(pool), flow_(flow), job_(job) {
    waitHooks = this;
  }
  ~RunningSlot() override { waitHooks = nullptr; }
  RunningSlot(const RunningSlot&) = delete;
  RunningSlot& operator=(const RunningSlot&) = delete;

  void beforeWait() override {
    const std::lock_guard lock(pool_.mutex_);
    --pool_.working_;
    ++pool_.paused_;
    pool_.waiting_.pause(flow_);
    pool_.startThreadIfNeeded();
    pool_.changed_.notify_all();
  }
  void afterWait() noexcept override {
    std::unique_lock lock(pool_.mutex_);
    ++pool_.returning_;
    // A cancelled job may end without a slot.
    pool_.changed_.wait(lock, job_.cancelled(), [&] { return pool_.working_ < pool_.maxJobs_; });
    --pool_.returning_;
    --pool_.paused_;
    ++pool_.working_;
    pool_.waiting_.resume(flow_);
    pool_.changed_.notify_all();
  }

 private:
  BackgroundThreads& pool_;
  const std::string& flow_;
  const Job& job_;
};

BackgroundThreads::~BackgroundThreads() {
  std::list<std::shared_ptr<Job>> jobs;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    jobs = jobs_;
  }
  for (const auto& job : jobs) job->cancel();
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

std::shared_ptr<Background::Job> BackgroundThreads::start(const std::string& flow, Work work,
                                                          std::function<void()> ended) {
  auto job = std::make_shared<Job>(std::move(work));
  {
    const std::lock_guard lock(mutex_);
    auto entry = std::make_unique<Entry>();
    entry->job = job;
    entry->ended = ended;
    entry->onCancel.emplace(job->cancelled(), [this, flow, &which = *job] { skip(flow, which); });
    jobs_.push_back(job);
    waiting_.push(flow, std::move(entry));
    startThreadIfNeeded();
    if (!threads_.empty()) {
      changed_.notify_all();
      return job;
    }
    waiting_.withdraw(flow, [&](const auto& one) { return one->job == job; });
    jobs_.remove(job);
  }
  job->run();
  ended();
  return job;
}

/// Starts a thread for a waiting job, unless a thread is idle or the limit is reached. Requires the mutex.
void BackgroundThreads::startThreadIfNeeded() {
  if (idle_ >= waiting_.waiting() || threads_.size() >= maxJobs_ + paused_) return;
  try {
    threads_.emplace_back([this] { runJobs(); });
  } catch (const std::exception&) {  // the existing threads do the work
  }
}

void BackgroundThreads::runJobs() {
  lowerThreadPriority();
  std::unique_lock lock(mutex_);
  for (;;) {
    ++idle_;
    changed_.wait(lock, [&] { return ending_ || mayBegin(); });
    --idle_;
    if (!mayBegin()) return;
    auto [flow, entry] = waiting_.take();
    ++working_;
    lock.unlock();
    entry->onCancel.reset();
    {
      const RunningSlot slot(*this, flow, *entry->job);
      entry->job->run();
    }
    entry->ended();
    const auto job = entry->job;
    entry.reset();
    lock.lock();
    --working_;
    waiting_.end(flow);
    jobs_.remove(job);
    if (returning_ > 0) changed_.notify_all();
  }
}

/// Ends a waiting job.
void BackgroundThreads::skip(const std::string& flow, const Job& job) {
  std::optional<std::unique_ptr<Entry>> skipped;
  {
    const std::lock_guard lock(mutex_);
    skipped = waiting_.withdraw(flow, [&](const auto& one) { return one->job.get() == &job; });
    if (!skipped) return;
    jobs_.remove((*skipped)->job);
  }
  (*skipped)->job->skip();
  (*skipped)->ended();
}

}  // namespace scolopax::server
