// SPDX-License-Identifier: Apache-2.0
// Jobs that would hold up the thread of a loop: building scenes, encoding large pictures.
#pragma once
#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

namespace scolopax::server {

class Background {
 public:
  using Work = std::function<void(std::stop_token)>;

  class Job {
   public:
    explicit Job(Work work) : work_(std::move(work)) {}
    bool done() const;
    /// Requests an early end. A job that has not begun ends at once, without doing its work.
    void cancel() { stop_.request_stop(); }
    /// Throws what the work threw, if anything; Error(cancelled) if it was not done. To be called once, when
    /// done().
    void rethrow() { result_.get(); }
    /// For implementations of Background, one of which is called once: does the work, or leaves it. Both
    /// destroy the work, with all that it holds, before done() becomes true.
    void run();
    void leave();
    std::stop_token cancelled() const { return stop_.get_token(); }

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

/// Runs a limited number of jobs at once, on threads of low priority; the others wait for their turn, in the
/// order in which they came. If the system cannot create even one thread, start() runs the job itself. A job
/// must not wait for another.
class BackgroundThreads : public Background {
 public:
  /// `mostAtOnce`: number of jobs, from 1; by default one per processor.
  explicit BackgroundThreads(std::size_t mostAtOnce = std::max(1u, std::thread::hardware_concurrency()))
      : mostAtOnce_(mostAtOnce) {}
  ~BackgroundThreads() override;  ///< cancels the jobs and waits for them
  std::shared_ptr<Job> start(Work work, std::function<void()> ended) override;

 private:
  struct Entry {
    std::shared_ptr<Job> job;
    std::function<void()> ended;
    std::optional<std::stop_callback<std::function<void()>>> onCancel = {};
  };
  void startThread();
  void work();
  void leave(const Job& job);

  const std::size_t mostAtOnce_;
  std::mutex mutex_;  ///< not held while entries are destroyed
  std::condition_variable came_;
  std::list<Entry> waiting_, running_;  ///< the oldest first
  std::vector<std::thread> threads_;
  std::size_t idle_ = 0;  ///< threads without a job
  bool ending_ = false;
};

}  // namespace scolopax::server
