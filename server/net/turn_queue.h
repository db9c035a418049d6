// SPDX-License-Identifier: Apache-2.0
// A queue of jobs that wait for a thread, in which flows take turns. Used by FairPool and BackgroundThreads,
// which have the threads.
#pragma once
#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace scolopax::net {

/// However many jobs a flow has, another flow waits for at most one of them on each thread. The jobs of a
/// flow begin in the order in which they were pushed. Not thread-safe.
template <class Job>
class TurnQueue {
 public:
  /// `perFlow`: number of jobs of a flow that may run at once, at least 1.
  explicit TurnQueue(std::size_t perFlow) : perFlow_(perFlow) {}
  TurnQueue(const TurnQueue&) = delete;
  TurnQueue& operator=(const TurnQueue&) = delete;

  struct Turn {
    std::string flow;
    Job job;
  };

  void push(const std::string& flow, Job job) {
    const auto at = flows_.try_emplace(flow).first;
    at->second.waiting.push_back(std::move(job));
    ++waiting_;
    lineUp(at);
  }
  /// Whether a job may begin.
  bool ready() const { return !turns_.empty(); }
  /// Number of jobs that have not begun.
  std::size_t waiting() const { return waiting_; }
  /// Whether no job waits, runs or is paused.
  bool idle() const { return flows_.empty(); }
  /// Takes the next job, which counts as running from then on. Requires ready().
  Turn take() {
    const auto at = turns_.front();
    turns_.pop_front();
    Flow& flow = at->second;
    flow.linedUp = false;
    Turn turn{at->first, std::move(flow.waiting.front())};
    flow.waiting.pop_front();
    --waiting_;
    ++flow.running;
    lineUp(at);
    return turn;
  }
  /// A job of the flow has ended.
  void end(const std::string& flow) {
    const auto at = flows_.find(flow);
    --at->second.running;
    lineUp(at);
    forgetIfEmpty(at);
  }
  /// A running job of the flow waits for something. Other jobs of the flow may begin meanwhile. Must be
  /// followed by resume().
  void pause(const std::string& flow) {
    const auto at = flows_.find(flow);
    --at->second.running;
    ++at->second.paused;
    lineUp(at);
  }
  void resume(const std::string& flow) noexcept {
    Flow& resumed = flows_.find(flow)->second;
    --resumed.paused;
    ++resumed.running;
  }
  /// Removes and returns the flow's first waiting job for which `is` is true.
  std::optional<Job> withdraw(const std::string& flow, const std::function<bool(const Job&)>& is) {
    const auto at = flows_.find(flow);
    if (at == flows_.end()) return std::nullopt;
    std::list<Job>& jobs = at->second.waiting;
    const auto found = std::find_if(jobs.begin(), jobs.end(), is);
    if (found == jobs.end()) return std::nullopt;
    std::optional<Job> job(std::move(*found));
    jobs.erase(found);
    --waiting_;
    if (jobs.empty() && std::exchange(at->second.linedUp, false)) std::erase(turns_, at);
    forgetIfEmpty(at);
    return job;
  }

 private:
  struct Flow {
    std::list<Job> waiting;
    std::size_t running = 0, paused = 0;
    bool linedUp = false;  ///< it is in turns_
  };
  using Flows = std::map<std::string, Flow>;
  using FlowAt = typename Flows::iterator;

  void lineUp(FlowAt at) {
    Flow& flow = at->second;
    if (flow.linedUp || flow.waiting.empty() || flow.running >= perFlow_) return;
    turns_.push_back(at);
    flow.linedUp = true;
  }
  void forgetIfEmpty(FlowAt at) {
    const Flow& flow = at->second;
    if (flow.waiting.empty() && flow.running + flow.paused == 0) flows_.erase(at);
  }

  const std::size_t perFlow_;
  Flows flows_;  ///< those with jobs
  std::deque<FlowAt> turns_;
  std::size_t waiting_ = 0;
};

}  // namespace scolopax::net
