// SPDX-License-Identifier: Apache-2.0
// Accounts for the memory of long answers until they have been sent. The client determines how long that
// takes, so there is a limit for each flow and one for all. Used by the handlers; charges the memory budget.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "renderer/core/memory_budget.h"

namespace scolopax::server {

/// May be used from any thread. The result of take() may outlive this object.
class UnsentAnswers {
 public:
  /// Bytes that a flow may always have unsent, even if all flows together exceed their limit.
  static constexpr std::uint64_t kFairBytes = 1 << 20;

  /// Unsent answers may take a quarter of the budget, and those of one flow (net::Request::flow) half of
  /// that. With a null `memory` there is no limit.
  explicit UnsentAnswers(std::shared_ptr<MemoryBudget> memory);

  /// Reserves memory for an answer of so many bytes. To be kept until the answer has been sent; null if the
  /// answer has no more than MemoryBudget::kFreeBytes. A flow may exceed its limit with a single answer.
  /// Throws Error(tooLarge) if the answer can never fit, and Error(busy) if it does not fit now.
  std::shared_ptr<const void> take(const std::string& flow, std::uint64_t bytes) const;

 private:
  struct State;
  const std::shared_ptr<State> state_;
};

}  // namespace scolopax::server
