// SPDX-License-Identifier: Apache-2.0
#include "server/net/outbox.h"

#include <algorithm>
#include <utility>

namespace scolopax::net {

bool Outbox::pushText(std::string text) {
  if (closing()) return true;
  if (texts_.size() >= textLimit_) return false;
  texts_.push_back(std::move(text));
  return true;
}

void Outbox::offer(Frame frame) {
  if (closing()) return;
  if (pending_) ++stats_.framesReplaced;
  pending_ = std::move(frame);
  stats_.framePending = true;
}

void Outbox::withdraw() {
  pending_.reset();
  stats_.framePending = false;
}

void Outbox::acknowledge(std::uint32_t number) {
  // Cumulative, so that one lost or omitted acknowledgement does not shrink the window for good.
  const auto found = std::find(unacknowledged_.begin(), unacknowledged_.end(), number);
  if (found == unacknowledged_.end()) return;
  unacknowledged_.erase(unacknowledged_.begin(), found + 1);
  stats_.unacknowledged = static_cast<int>(unacknowledged_.size());
}

void Outbox::close(CloseMessage message, bool dropTexts) {
  if (dropTexts) texts_.clear();
  if (closing()) return;
  close_ = std::move(message);
  pending_.reset();
  stats_.framePending = false;
}

void Outbox::clear() {
  texts_.clear();
  pending_.reset();
  close_.reset();
  closeSent_ = true;
  stats_.framePending = false;
}

std::optional<Outbox::Item> Outbox::next() {
  if (!texts_.empty()) {
    Item item = std::move(texts_.front());
    texts_.pop_front();
    ++stats_.textsSent;
    return item;
  }
  if (close_) {
    Item item = std::move(*close_);
    close_.reset();
    closeSent_ = true;
    return item;
  }
  if (pending_ && unacknowledged_.size() < static_cast<std::size_t>(kFrameWindow)) {
    Item item = std::move(*pending_);
    pending_.reset();
    unacknowledged_.push_back(std::get<Frame>(item).number);
    ++stats_.framesSent;
    stats_.framePending = false;
    stats_.unacknowledged = static_cast<int>(unacknowledged_.size());
    return item;
  }
  return std::nullopt;
}

}  // namespace scolopax::net
