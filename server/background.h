// SPDX-License-Identifier: Apache-2.0
// Runs jobs in the background that would delay the thread that needs their results: building scenes, passes
// and picks with slow rays, making and encoding large pictures.
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
    /// Requests that the job end early. A job that has not begun ends at once, without doing its work.
    void cancel() { stop_.request_stop(); }
    /// Throws the exception that the work threw, if any, and Error(cancelled) if the work was skipped. To be
    /// called once, when done().
    void rethrow() { result_.get(); }
    /// For implementations of Background, which call one of the two, once. run() does the work, and skip()
    /// ends the job without doing it. Both destroy the work and everything that it holds before done()
    /// becomes true.
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
  /// Jobs belong to flows, which take turns. A flow is named by a session's id or a client's address. `ended`
  /// is called, on any thread, after done() has become true.
  virtual std::shared_ptr<Job> start(const std::string& flow, Work work, std::function<void()> ended) = 0;
  /// Runs a job and waits for it. Throws what the work throws. If `stop` is requested before the job has
  /// begun, throws Error(cancelled); later, it requests the work's own token.
  void run(const std::string& flow, const std::stop_token& stop, Work work);
};

/// Number of processors, at least 1.
inline std::size_t processors() { return std::max(1u, std::thread::hardware_concurrency()); }

/// Runs a limited number of jobs at once, on threads of low priority. The others wait for the turns of their
/// flows. One flow may use at most half of the slots, but always one. While a job waits for a shared build
/// (renderer/core/shared_builds.h), another job may use its slot. If the system cannot create even one
/// thread, start() runs the job itself. A job must not wait for another job.
class BackgroundThreads : public Background {
 public:
  /// `maxJobs`: number of jobs that run at once, at least 1.
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
  std::condition_variable_any changed_;  ///< notified when one of the members below changes
  Turns waiting_;
  std::list<std::shared_ptr<Job>> jobs_;  ///< waiting and running
  std::vector<std::thread> threads_;
  std::size_t idle_ = 0;       ///< threads without a job
  std::size_t working_ = 0;    ///< jobs that hold a slot
  std::size_t paused_ = 0;     ///< jobs that wait for a build, or for a slot after it
  std::size_t returning_ = 0;  ///< of these, the jobs that wait for a slot; they get it before new jobs do
  bool ending_ = false;
};

}  // namespace scolopax::server
