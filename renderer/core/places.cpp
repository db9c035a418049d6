// SPDX-License-Identifier: Apache-2.0
#include "renderer/core/places.h"

#include "renderer/core/error.h"

namespace scolopax {

std::size_t Places::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

Places::Place::Place(Places& places, const std::stop_token& stop) : places_(places) {
  std::unique_lock lock(places_.mutex_);
  places_.waiting_.push_back(this);
  const bool free = places_.changed_.wait(
      lock, stop, [&] { return places_.free_ > 0 && places_.waiting_.front() == this; });
  std::erase(places_.waiting_, this);
  if (free) --places_.free_;
  places_.changed_.notify_all();  // the next one may now be the first
  if (!free) throw Error(ErrorCode::cancelled, "cancelled before there was a place for it");
}

Places::Place::~Place() {
  const std::lock_guard lock(places_.mutex_);
  ++places_.free_;
  places_.changed_.notify_all();
}

}  // namespace scolopax
