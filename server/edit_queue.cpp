// SPDX-License-Identifier: Apache-2.0
#include "server/edit_queue.h"

#include <string>
#include <utility>

#include "protocol/problem.h"

namespace scolopax::server {

void EditQueue::push(Edit edit) {
  {
    const std::lock_guard lock(mutex_);
    if (!roomFor(edit))
      throw protocol::limitReached(
          429, kMaxEdits, "edits or " + std::to_string(kMaxBytes) + " bytes of them waiting in one stream");
    bytes_ += edit.bytes;
    ++count_;
    waiting_.push_back(std::move(edit));
    if (std::exchange(atWork_, true)) return;
  }
  if (!applyAll())
    background_.start(
        session_, [self = shared_from_this()](const std::stop_token& stop) { self->applyMeasured(stop); },
        [] {});
}

void EditQueue::end() {
  ended_.request_stop();
  std::deque<Edit> left;
  {
    const std::lock_guard applied(applying_);
    const std::lock_guard lock(mutex_);
    left = std::exchange(waiting_, {});
  }
  for (const Edit& edit : left) abandon(edit);
}

void EditQueue::abandon(const Edit& edit) {
  edit.failed(std::make_exception_ptr(
      protocol::ProtocolError(409, "", "the stream left the session while this edit was waiting")));
  done(edit);
}

void EditQueue::done(const Edit& edit) {
  const std::lock_guard lock(mutex_);
  bytes_ -= edit.bytes;
  --count_;
}

bool EditQueue::roomFor(const Edit& edit) const {
  return count_ == 0 || (count_ < kMaxEdits && bytes_ + edit.bytes <= kMaxBytes);
}

std::optional<EditQueue::Edit> EditQueue::next() {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty() || ended_.stop_requested()) {
    atWork_ = false;
    return std::nullopt;
  }
  Edit edit = std::move(waiting_.front());
  waiting_.pop_front();
  return edit;
}

/// False if the next edit must wait.
bool EditQueue::applyAll() {
  while (auto edit = next()) {
    const std::lock_guard applying(applying_);
    if (ended_.stop_requested()) {
      abandon(*edit);
      continue;
    }
    try {
      edit->apply();
    } catch (const Unmeasured& missing) {
      missing_ = missing;
      const std::lock_guard lock(mutex_);
      waiting_.push_front(std::move(*edit));
      return false;
    } catch (...) {
      edit->failed(std::current_exception());
    }
    done(*edit);
  }
  return true;
}

void EditQueue::applyMeasured(const std::stop_token& stop) {
  const std::stop_callback end(stop, [this] { ended_.request_stop(); });
  do {
    try {
      missing_->measure(ended_.get_token());
    } catch (...) {
      if (const auto edit = next()) {
        edit->failed(std::current_exception());
        done(*edit);
      }
    }
  } while (!applyAll());
}

}  // namespace scolopax::server
