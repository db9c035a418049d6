// SPDX-License-Identifier: Apache-2.0
#include "server/pass_interrupter.h"

namespace scolopax::server {

void PassInterrupter::stop() {
  stopping_ = true;  // first: see reset()
  interrupted_ = urgentInterrupted_ = true;
}

void PassInterrupter::reset() {
  interrupted_ = urgentInterrupted_ = false;
  if (stopping_) interrupted_ = urgentInterrupted_ = true;  // stop() may have been called in between
}

std::optional<TimePoint> PassInterrupter::watch() {
  const std::lock_guard lock(mutex_);
  if (latest_ && now_() >= *latest_) {
    interrupted_ = urgentInterrupted_ = true;
    latest_.reset();
  }
  return nextLook_ = latest_;
}

void PassInterrupter::begin(TimePoint latest) {
  {
    const std::lock_guard lock(mutex_);
    latest_ = latest;
    // Passes usually end in time. Waking the watching thread for each of them is unnecessary: it finds the
    // current pass when it checks the next time.
    if (nextLook_ && *nextLook_ <= latest) return;
    nextLook_ = latest;
  }
  wake_();
}

void PassInterrupter::end() {
  const std::lock_guard lock(mutex_);
  latest_.reset();
}

}  // namespace scolopax::server
