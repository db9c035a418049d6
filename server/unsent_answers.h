// SPDX-License-Identifier: Apache-2.0
// Memory of long answers from the time when they are ready until they have been sent. A client decides how
// long that takes, so there is a limit for each and one for all. Between the handlers and the memory budget.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "renderer/core/memory_budget.h"

namespace scolopax::server {

/// May be used from any thread. What take() returns may outlive this object.
class UnsentAnswers {
 public:
  /// What a flow may have unsent even if all together have more than they may.
  static constexpr std::uint64_t kFairBytes = 1 << 20;

  /// A quarter of the budget is for unsent answers, and half of that for those of one flow
  /// (net::Request::flow). A null `memory` grants every request.
  explicit UnsentAnswers(std::shared_ptr<MemoryBudget> memory);

  /// To be kept until an answer of so many bytes has been sent; null if it has no more than
  /// MemoryBudget::kFreeBytes. A flow may exceed its limit with a single answer. Throws Error(tooLarge) if
  /// there is never memory for the answer, and Error(busy) if there is none now.
  std::shared_ptr<const void> take(const std::string& flow, std::uint64_t bytes) const;

 private:
  struct State;
  const std::shared_ptr<State> state_;
};

}  // namespace scolopax::server
