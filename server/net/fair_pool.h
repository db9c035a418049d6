// SPDX-License-Identifier: Apache-2.0
// Threads with fair queuing: jobs belong to flows, and flows take turns. However many jobs one flow has, and
// however long they take, another flow waits for at most one job of it.
#pragma once
#include <future>
#include <memory>
#include <string>

namespace scolopax::net {

class FairPool {
 public:
  /// Like std::function<void()>, but may hold what cannot be copied.
  using Job = std::packaged_task<void()>;

  explicit FairPool(int threads);
  ~FairPool();  ///< as join()
  FairPool(const FairPool&) = delete;
  FairPool& operator=(const FairPool&) = delete;

  /// From any thread. The jobs of a flow begin in the order in which they were posted, one at a time.
  void post(const std::string& flow, Job job);
  /// Runs all jobs, including those that they post meanwhile, and ends the threads. Safe to call twice.
  void join();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scolopax::net
