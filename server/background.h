// SPDX-License-Identifier: Apache-2.0
// Jobs that would hold up the thread that needs their results: building scenes, passes with slow rays, making
// and encoding large pictures.
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
#include <string>
#include <thread>
#include <vector>

#include "server/net/turn_queue.h"

namespace scolopax::server {

class Background {
 public:
  using Work = std::function<void(std::stop_token)>;

  class Job {
   public:
    explicit Job(Work work) : work_(std::move(work)) {}
    bool done() const;
    /// Waits until done().
    void wait() const { result_.wait(); }
    /// Requests an early end. A job that has not begun ends at once, without doing its work.
    void cancel() { stop_.request_stop(); }
    /// Throws what the work threw, if anything; Error(cancelled) if it was not done. To be called once, when
    /// done().
    void rethrow() { result_.get(); }
    /// For implementations of Background, one of which is called once: run() does the work; skip() ends the
    /// job without doing it. Both destroy the work, with all that it holds, before done() becomes true.
    void run();
    void skip();
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
  /// Jobs belong to flows, which take turns: a session's id, or a client's address. `ended` is called, on any
  /// thread, after done() has become true.
  virtual std::shared_ptr<Job> start(const std::string& flow, Work work, std::function<void()> ended) = 0;
  /// Runs a job and waits for it. Throws what the work throws; and Error(cancelled) once `stop` is requested,
  /// unless the job has begun: then the work's own token is requested.
  void run(const std::string& flow, const std::stop_token& stop, Work work);
};

/// Number of processors, from 1.
inline std::size_t processors() { return std::max(1u, std::thread::hardware_concurrency()); }

/// Runs a limited number of jobs at once, on threads of low priority; the others wait for the turns of their
/// flows. One flow has at most half of these places, or one. While a job waits for a shared build
/// (renderer/core/shared_builds.h), others use its place. If the system cannot create even one thread,
/// start() runs the job itself. A job must not wait for another.
class BackgroundThreads : public Background {
 public:
  /// `maxJobs`: that run at once, from 1.
  explicit BackgroundThreads(std::size_t maxJobs = processors())
      : maxJobs_(maxJobs), waiting_(std::max<std::size_t>(1, maxJobs / 2)) {}
  ~BackgroundThreads() override;  ///< cancels the jobs and waits for them
  std::shared_ptr<Job> start(const std::string& flow, Work work, std::function<void()> ended) override;

 private:
  struct Entry {
    std::shared_ptr<Job> job;
    std::function<void()> ended;
    std::optional<std::stop_callback<std::function<void()>>> onCancel = {};
  };
  using Turns = net::TurnQueue<std::unique_ptr<Entry>>;
  class RunningSlot;
  bool mayBegin() const { return waiting_.ready() && working_ < maxJobs_ && returning_ == 0; }
  void startThreadIfNeeded();
  void runJobs();
  void skip(const std::string& flow, const Job& job);

  const std::size_t maxJobs_;
  std::mutex mutex_;                     ///< not held while entries are destroyed
  std::condition_variable_any changed_;  ///< any of the members below
  Turns waiting_;
  std::list<std::shared_ptr<Job>> jobs_;  ///< that are not over
  std::vector<std::thread> threads_;
  std::size_t idle_ = 0;       ///< threads without a job
  std::size_t working_ = 0;    ///< jobs that run and do not wait for a build
  std::size_t paused_ = 0;     ///< jobs that wait for a build, or for a place after it
  std::size_t returning_ = 0;  ///< of these, those that wait for a place, which they get before new jobs
  bool ending_ = false;
};

}  // namespace scolopax::server
