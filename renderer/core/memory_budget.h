// SPDX-License-Identifier: Apache-2.0
// A limit on the memory that requests make a server allocate: films, pictures, encodings, macrocells, long
// answers, scenes with long curves. Large allocations are charged here first; a refusal states the limit.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string_view>
#include <utility>

namespace scolopax {

/// What memory is used for.
enum class MemoryUse { films, grids, pictures, encodings, answers, scenes };
inline constexpr std::string_view kMemoryUses[] = {"films",     "grids",   "pictures",
                                                   "encodings", "answers", "scenes"};

/// Every function may be called from any thread. Shares keep the budget alive.
class MemoryBudget : public std::enable_shared_from_this<MemoryBudget> {
 public:
  /// The last quarter of the budget is reserved for shares up to this size, so that large ones cannot starve
  /// small ones. A film of 1920x1080 pixels takes 192 MiB.
  static constexpr std::uint64_t kOrdinaryBytes = 256 << 20;

  /// Callers do not charge scenes and answers up to this size, so that ordinary requests do not depend on
  /// memory that others may hold.
  static constexpr std::uint64_t kFreeBytes = 64 << 10;

  explicit MemoryBudget(std::uint64_t limitBytes) : limit_(limitBytes) {}

  /// Bytes charged to a budget for the lifetime of the share. A default-constructed share belongs to no
  /// budget and may take any size.
  class Share {
   public:
    Share() = default;
    Share(Share&& other) noexcept { *this = std::move(other); }
    Share& operator=(Share&& other) noexcept;
    ~Share();
    /// Throws Error(tooLarge) if the budget never has so many bytes, Error(busy) if it does not have them
    /// now; the share then keeps its size.
    void resize(std::uint64_t bytes);
    std::uint64_t bytes() const { return bytes_; }

   private:
    friend class MemoryBudget;
    Share(std::shared_ptr<MemoryBudget> budget, MemoryUse use) : budget_(std::move(budget)), use_(use) {}
    std::shared_ptr<MemoryBudget> budget_;
    MemoryUse use_ = MemoryUse::films;
    std::uint64_t bytes_ = 0;
  };
  /// Throws like Share::resize. A null `budget` grants every request.
  static Share take(const std::shared_ptr<MemoryBudget>& budget, MemoryUse use, std::uint64_t bytes = 0);
  /// Like take(), for memory with several owners.
  static std::shared_ptr<Share> takeShared(const std::shared_ptr<MemoryBudget>& budget, MemoryUse use,
                                           std::uint64_t bytes);

  /// Before a request is refused because others hold the memory, `release` is called, on any thread and with
  /// no lock held; if it returns true, it has released some, and the request is tried again.
  void setRelease(std::function<bool()> release);
  /// Calls `release`, also for memory that is not charged here, such as that of devices. Returns whether some
  /// was released.
  bool releaseSome();

  std::uint64_t limit() const { return limit_; }
  /// The most that may be in use after a share of this size has been taken.
  std::uint64_t most(std::uint64_t bytes) const { return bytes <= kOrdinaryBytes ? limit_ : limit_ / 4 * 3; }
  std::uint64_t used(MemoryUse use) const;

 private:
  void change(MemoryUse use, std::uint64_t from, std::uint64_t to);
  std::uint64_t total() const;

  const std::uint64_t limit_;
  mutable std::mutex mutex_;
  std::function<bool()> release_;
  std::array<std::uint64_t, std::size(kMemoryUses)> used_{};
};

/// Shared ownership of `value` and of the memory charged for it; the last owner releases both.
template <class T>
std::shared_ptr<const T> withShare(MemoryBudget::Share share, T value) {
  struct Held {
    MemoryBudget::Share share;
    T value;
  };
  const auto held = std::make_shared<const Held>(Held{std::move(share), std::move(value)});
  return {held, &held->value};
}

}  // namespace scolopax
