// SPDX-License-Identifier: Apache-2.0
#include "server/net/request_slots.h"

#include <algorithm>

namespace scolopax::net {

RequestSlots::Slot RequestSlots::takeLong(bool ofQuickRoute) {
  const std::lock_guard lock(mutex_);
  if (long_ >= mostLong_ || (ofQuickRoute && quick_ >= std::max(1, mostLong_ / 4))) return nullptr;
  ++long_;
  quick_ += ofQuickRoute;
  return {this, [ofQuickRoute](RequestSlots* slots) {
            const std::lock_guard releasing(slots->mutex_);
            --slots->long_;
            slots->quick_ -= ofQuickRoute;
          }};
}

RequestSlots::Slot RequestSlots::takeWaiting(const std::string& flow) {
  const std::lock_guard lock(mutex_);
  const auto known = waiting_.find(flow);
  if ((known == waiting_.end() ? 0 : known->second) >= mostWaiting_) return nullptr;
  ++waiting_[flow];
  return {this, [flow](RequestSlots* slots) { slots->releaseWaiting(flow); }};
}

void RequestSlots::releaseWaiting(const std::string& flow) {
  const std::lock_guard lock(mutex_);
  const auto count = waiting_.find(flow);
  if (--count->second == 0) waiting_.erase(count);
}

}  // namespace scolopax::net
