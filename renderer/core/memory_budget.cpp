// SPDX-License-Identifier: Apache-2.0
#include "renderer/core/memory_budget.h"

#include <numeric>
#include <string>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"

namespace scolopax {

MemoryBudget::Share& MemoryBudget::Share::operator=(Share&& other) noexcept {
  std::swap(budget_, other.budget_);
  std::swap(use_, other.use_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

MemoryBudget::Share::~Share() {
  if (budget_) budget_->change(use_, bytes_, 0);
}

void MemoryBudget::Share::resize(std::uint64_t bytes) {
  if (budget_) budget_->change(use_, bytes_, bytes);
  bytes_ = bytes;
}

MemoryBudget::Share MemoryBudget::take(const std::shared_ptr<MemoryBudget>& budget, MemoryUse use,
                                       std::uint64_t bytes) {
  Share share(budget, use);
  share.resize(bytes);
  return share;
}

std::shared_ptr<MemoryBudget::Share> MemoryBudget::takeShared(const std::shared_ptr<MemoryBudget>& budget,
                                                              MemoryUse use, std::uint64_t bytes) {
  return std::make_shared<Share>(take(budget, use, bytes));
}

std::uint64_t MemoryBudget::total() const {
  return std::accumulate(used_.begin(), used_.end(), std::uint64_t(0));
}

std::uint64_t MemoryBudget::used(MemoryUse use) const {
  const std::lock_guard lock(mutex_);
  return used_[std::size_t(use)];
}

void MemoryBudget::setRelease(std::function<bool()> release) {
  const std::lock_guard lock(mutex_);
  release_ = std::move(release);
}

bool MemoryBudget::releaseSome() {
  std::function<bool()> release;
  {
    const std::lock_guard lock(mutex_);
    release = release_;
  }
  return release && release();
}

void MemoryBudget::change(MemoryUse use, std::uint64_t from, std::uint64_t to) {
  for (;;) {
    std::function<bool()> release;
    std::string refusal;
    {
      const std::lock_guard lock(mutex_);
      const std::uint64_t allowed = most(to), others = total() - from;
      if (to <= from || (to <= allowed && others <= allowed - to)) {
        used_[std::size_t(use)] += to;
        used_[std::size_t(use)] -= from;
        return;
      }
      refusal = "memory for " + std::string(kMemoryUses[std::size_t(use)]) + ": expected at most " +
                mebibytes(allowed) + (others > 0 ? ", of which " + mebibytes(others) + " are in use" : "") +
                ", found " + mebibytes(to);
      if (to > allowed) throw Error(ErrorCode::tooLarge, refusal);
      release = release_;
    }
    if (!release || !release()) throw Error(ErrorCode::busy, refusal);
  }
}

}  // namespace scolopax
