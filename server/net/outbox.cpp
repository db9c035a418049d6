// SPDX-License-Identifier: Apache-2.0
#include "server/net/outbox.h"

#include <algorithm>
#include <utility>

namespace scolopax::net {

bool Outbox::pushText(SharedText text) {
  if (closing()) return true;
  if (texts_.size() >= limits_.count) return false;
  const std::size_t bytes = text->size();
  unsent_ += bytes;
  const std::size_t all = unsentByAll_->fetch_add(bytes) + bytes;
  const bool mineFit = texts_.empty() || unsent_ <= limits_.bytes;
  if (unsent_ > limits_.fairBytes && !(mineFit && all <= limits_.bytesOfAll)) {
    release(bytes);
    return false;
  }
  texts_.push_back(std::move(text));
  return true;
}

void Outbox::release(std::size_t bytes) {
  unsent_ -= bytes;
  *unsentByAll_ -= bytes;
}

void Outbox::dropTexts() {
  texts_.clear();
  release(unsent_ - sending_);
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
  // Cumulative, so that a missing acknowledgement does not shrink the window for good.
  const auto found = std::find(unacknowledged_.begin(), unacknowledged_.end(), number);
  if (found == unacknowledged_.end()) return;
  unacknowledged_.erase(unacknowledged_.begin(), found + 1);
  stats_.unacknowledged = static_cast<int>(unacknowledged_.size());
}

void Outbox::close(CloseMessage message, bool withoutTexts) {
  if (withoutTexts) dropTexts();
  if (closing()) return;
  close_ = std::move(message);
  pending_.reset();
  stats_.framePending = false;
}

void Outbox::clear() {
  dropTexts();
  release(std::exchange(sending_, 0));
  pending_.reset();
  close_.reset();
  closeSent_ = true;
  stats_.framePending = false;
}

std::optional<Outbox::Item> Outbox::next() {
  release(std::exchange(sending_, 0));
  if (!texts_.empty()) {
    sending_ = texts_.front()->size();
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
