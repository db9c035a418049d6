// SPDX-License-Identifier: Apache-2.0
#include "server/net/request_places.h"

#include <algorithm>

namespace scolopax::net {

RequestPlaces::Place RequestPlaces::takeLong(bool ofQuickRoute) {
  const std::lock_guard lock(mutex_);
  if (long_ >= mostLong_ || (ofQuickRoute && quick_ >= std::max(1, mostLong_ / 4))) return nullptr;
  ++long_;
  quick_ += ofQuickRoute;
  return {this, [ofQuickRoute](RequestPlaces* places) {
            const std::lock_guard leaving(places->mutex_);
            --places->long_;
            places->quick_ -= ofQuickRoute;
          }};
}

RequestPlaces::Place RequestPlaces::takeWaiting(const std::string& flow) {
  const std::lock_guard lock(mutex_);
  const auto known = waiting_.find(flow);
  if ((known == waiting_.end() ? 0 : known->second) >= mostWaiting_) return nullptr;
  ++waiting_[flow];
  return {this, [flow](RequestPlaces* places) { places->leaveWaiting(flow); }};
}

void RequestPlaces::leaveWaiting(const std::string& flow) {
  const std::lock_guard lock(mutex_);
  const auto count = waiting_.find(flow);
  if (--count->second == 0) waiting_.erase(count);
}

}  // namespace scolopax::net
