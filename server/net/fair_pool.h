// SPDX-License-Identifier: Apache-2.0
// A thread pool with fair queuing. Jobs belong to flows, and flows take turns. However many jobs a flow has,
// and however long they take, another flow waits for at most one of them.
#pragma once
#include <functional>
#include <future>
#include <memory>
#include <string>

namespace scolopax::net {

class FairPool {
 public:
  /// Like std::function<void()>, but may hold objects that cannot be copied.
  using Job = std::packaged_task<void()>;

  /// `failed` is called on the pool's threads while an exception that a job has thrown is handled; it must
  /// not throw itself. The pool goes on with the next job.
  explicit FairPool(
      int threads, std::function<void()> failed = [] {});
  ~FairPool();  ///< as join()
  FairPool(const FairPool&) = delete;
  FairPool& operator=(const FairPool&) = delete;

  /// The jobs of a flow run in the order in which they were posted, one at a time. From any thread.
  void post(const std::string& flow, Job job);
  /// Runs all jobs, including jobs that they post, and ends the threads. May be called twice.
  void join();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::net
