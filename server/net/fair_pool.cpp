// SPDX-License-Identifier: Apache-2.0
#include "server/net/fair_pool.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace scolopax::net {

struct FairPool::Impl {
  struct Flow {
    std::deque<Job> waiting;
    int turns = 0;  ///< that it has in `turns` or that a thread is taking
  };
  using Flows = std::map<std::string, Flow>;

  std::mutex mutex;
  std::condition_variable changed;
  Flows flows;  ///< those with jobs
  std::deque<Flows::iterator> turns;
  bool joining = false;
  std::vector<std::thread> threads;

  void run() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return !turns.empty() || (joining && flows.empty()); });
      if (turns.empty()) return;
      takeTurn(lock);
    }
  }

  void takeTurn(std::unique_lock<std::mutex>& lock) {
    const auto at = turns.front();
    turns.pop_front();
    Flow& flow = at->second;
    if (!flow.waiting.empty()) {
      Job job = std::move(flow.waiting.front());
      flow.waiting.pop_front();
      lock.unlock();
      job();
      job = {};  // with all that it holds
      lock.lock();
    }
    if (!flow.waiting.empty()) {
      turns.push_back(at);  // wakes nobody: this thread takes the next turn
    } else if (--flow.turns == 0) {
      flows.erase(at);
      if (joining && flows.empty()) changed.notify_all();
    }
  }
};

FairPool::FairPool(int threads, const std::function<void()>& begin) : impl_(std::make_unique<Impl>()) {
  for (int i = 0; i < threads; ++i) {
    impl_->threads.emplace_back([this, begin] {
      if (begin) begin();
      impl_->run();
    });
  }
}

FairPool::~FairPool() { join(); }

void FairPool::post(const std::string& flow, Job job) {
  const std::lock_guard lock(impl_->mutex);
  const auto at = impl_->flows.try_emplace(flow).first;
  at->second.waiting.push_back(std::move(job));
  const int most = flow.empty() ? std::max(1, int(impl_->threads.size()) / 2) : 1;
  if (at->second.turns == most) return;
  ++at->second.turns;
  impl_->turns.push_back(at);
  impl_->changed.notify_one();
}

void FairPool::join() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->joining = true;
  }
  impl_->changed.notify_all();
  for (std::thread& thread : impl_->threads) {
    if (thread.joinable()) thread.join();
  }
}

}  // namespace scolopax::net
