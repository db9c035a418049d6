// SPDX-License-Identifier: Apache-2.0
// Jobs that would hold up the thread of a loop: building scenes, encoding large pictures.
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
    /// Requests an early end.
    void cancel() { stop_.request_stop(); }
    /// Throws what the work threw, if anything. To be called once, when done().
    void rethrow() { result_.get(); }
    /// For implementations of Background, to be called once. Destroys the work, with all that it holds,
    /// before done() becomes true.
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
  /// `ended` is called, on any thread, after done() has become true.
  virtual std::shared_ptr<Job> start(Work work, std::function<void()> ended) = 0;
};

/// Starts every job at once, on its own thread of low priority: no job waits for another. If the system
/// cannot create a thread, start() runs the job itself.
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
