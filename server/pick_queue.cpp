// SPDX-License-Identifier: Apache-2.0
#include "server/pick_queue.h"

#include <algorithm>
#include <utility>

#include "protocol/problem.h"

namespace scolopax::server {

PickId PickQueue::add(const PickQuery& query, std::uint32_t revision, ViewerId viewer, OnPicked answered) {
  if (picks_.size() >= kMaxPicks) throw protocol::limitReached(429, kMaxPicks, "picks waiting in a session");
  picks_.push_back({{++last_, query, revision}, viewer, std::move(answered)});
  return last_;
}

std::optional<PendingPick> PickQueue::oldest() const {
  if (picks_.empty()) return std::nullopt;
  return picks_.front();
}

OnPicked PickQueue::take(PickId id) {
  auto taken = takeIf([&](const Waiting& pick) { return pick.id == id; });
  return taken.empty() ? OnPicked() : std::move(taken.front());
}

std::vector<OnPicked> PickQueue::takeOf(ViewerId viewer) {
  return takeIf([&](const Waiting& pick) { return pick.viewer == viewer; });
}

std::vector<OnPicked> PickQueue::takeAll() {
  return takeIf([](const Waiting&) { return true; });
}

std::vector<OnPicked> PickQueue::takeIf(const std::function<bool(const Waiting&)>& wanted) {
  const auto first =
      std::stable_partition(picks_.begin(), picks_.end(), [&](const Waiting& pick) { return !wanted(pick); });
  std::vector<OnPicked> taken;
  for (auto pick = first; pick != picks_.end(); ++pick) taken.push_back(std::move(pick->answered));
  picks_.erase(first, picks_.end());
  return taken;
}

}  // namespace scolopax::server
