// SPDX-License-Identifier: Apache-2.0
// Work that would hold up the thread of a loop: building scenes, encoding large pictures.
#pragma once
#include <atomic>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

namespace scolopax::server {

class Background {
 public:
  using Work = std::function<void(std::stop_token)>;

  class Job {
   public:
    explicit Job(Work work) : work_(std::move(work)) {}
    bool done() const;
    /// Asks it to end early.
    void cancel() { stop_.request_stop(); }
    /// Throws what the work threw. Once, and only when it is done.
    void rethrow() { result_.get(); }
    /// For those who run it, once: what the work holds is gone before done() tells of it.
    void run();

   private:
    std::stop_source stop_;
    Work work_;
    std::promise<void> promise_;
    std::future<void> result_ = promise_.get_future();
  };

  Background() = default;
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  virtual ~Background() = default;
  /// `ended` is called, on whatever thread, after done() has become true.
  virtual std::shared_ptr<Job> start(Work work, std::function<void()> ended) = 0;
};

/// Every job at once, on a thread of its own and of low priority: none waits for another's end. Where the
/// system gives no thread, start() does the work itself.
class BackgroundThreads : public Background {
 public:
  ~BackgroundThreads() override;  ///< cancels the jobs and waits for them
  std::shared_ptr<Job> start(Work work, std::function<void()> ended) override;

 private:
  struct Running {
    std::shared_ptr<Job> job;
    std::atomic<bool> over{false};
    std::thread thread;
  };
  bool startThread(const std::shared_ptr<Job>& job, const std::function<void()>& ended);

  std::mutex mutex_;
  std::list<Running> running_;
};

}  // namespace scolopax::server
