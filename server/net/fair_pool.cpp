// SPDX-License-Identifier: Apache-2.0
#include "server/net/fair_pool.h"

#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "server/net/turn_queue.h"

namespace scolopax::net {

struct FairPool::Impl {
  explicit Impl(std::function<void()> onFailure) : failed(std::move(onFailure)) {}

  const std::function<void()> failed;
  std::mutex mutex;
  std::condition_variable changed;
  TurnQueue<Job> queue{1};
  bool joining = false;
  std::vector<std::thread> threads;

  void run() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return queue.ready() || (joining && queue.idle()); });
      if (!queue.ready()) return;
      auto turn = queue.take();
      if (queue.ready()) changed.notify_one();
      lock.unlock();
      auto done = turn.job.get_future();
      turn.job();
      try {
        done.get();
      } catch (...) {
        failed();
      }
      turn.job = {};  // with all that it holds
      lock.lock();
      queue.end(turn.flow);
      if (joining && queue.idle()) changed.notify_all();
    }
  }
};

FairPool::FairPool(int threads, std::function<void()> failed)
    : impl_(std::make_unique<Impl>(std::move(failed))) {
  for (int i = 0; i < threads; ++i) impl_->threads.emplace_back([this] { impl_->run(); });
}

FairPool::~FairPool() { join(); }

void FairPool::post(const std::string& flow, Job job) {
  const std::lock_guard lock(impl_->mutex);
  impl_->queue.push(flow, std::move(job));
  if (impl_->queue.ready()) impl_->changed.notify_one();
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
