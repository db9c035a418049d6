// SPDX-License-Identifier: Apache-2.0
#include "server/pass_ends.h"

namespace scolopax::server {

void PassEnds::stop() {
  stopping_ = true;  // first: see reset()
  interrupted_ = ended_ = true;
}

void PassEnds::reset() {
  interrupted_ = ended_ = false;
  if (stopping_) interrupted_ = ended_ = true;  // it may have been requested just before
}

std::optional<TimePoint> PassEnds::watch() {
  const std::lock_guard lock(mutex_);
  if (latest_ && now_() >= *latest_) {
    interrupted_ = ended_ = true;
    latest_.reset();
  }
  return nextLook_ = latest_;
}

void PassEnds::begin(TimePoint latest) {
  {
    const std::lock_guard lock(mutex_);
    latest_ = latest;
    // Usually a pass ends in time: then the watching thread finds the next one when it looks after this one.
    if (nextLook_ && *nextLook_ <= latest) return;
    nextLook_ = latest;
  }
  wake_();
}

void PassEnds::end() {
  const std::lock_guard lock(mutex_);
  latest_.reset();
}

}  // namespace scolopax::server
