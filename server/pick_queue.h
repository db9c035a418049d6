// SPDX-License-Identifier: Apache-2.0
// The picks of a session that wait for their answers. Belongs to Session, whose mutex guards it.
#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "server/pick.h"

namespace scolopax::server {

/// Calls no function that it stores: its owner does, without a lock.
class PickQueue {
 public:
  /// Maximum number of picks that wait at once.
  static constexpr std::size_t kMaxPicks = 8;

  /// `revision`: of the scene now. `viewer`: the one that asks. Throws ProtocolError(429) if too many picks
  /// wait already.
  PickId add(const PickQuery& query, std::uint32_t revision, ViewerId viewer, OnPicked answered);
  bool empty() const { return picks_.empty(); }
  /// The pick to be answered first.
  std::optional<PendingPick> oldest() const;
  /// Removes a pick and returns the function that waits for its answer; nullptr if the pick does not wait any
  /// more.
  OnPicked take(PickId id);
  /// The same for all picks of a viewer.
  std::vector<OnPicked> takeOf(ViewerId viewer);
  /// The same for all picks.
  std::vector<OnPicked> takeAll();

 private:
  struct Waiting : PendingPick {
    ViewerId viewer;
    OnPicked answered;
  };
  std::vector<OnPicked> takeIf(const std::function<bool(const Waiting&)>& wanted);

  std::vector<Waiting> picks_;  ///< the oldest first
  PickId last_ = 0;
};

}  // namespace scolopax::server
