// SPDX-License-Identifier: Apache-2.0
// Divides what only few clients can have at once (renders, sessions, streams) among those that ask for it.
#pragma once
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "server/frame.h"

namespace scolopax::server {

/// Every function may be called from any thread. Places may outlive this object.
class FairPlaces {
 public:
  /// A client that has been refused counts as waiting for this time. Until then it should ask again.
  static constexpr std::chrono::seconds kWaiting{10};

  FairPlaces(std::size_t most, Now now);

  /// Released by its last owner.
  using Place = std::shared_ptr<const void>;
  /// A place for a client, which its address identifies; null if there is none. While no other client waits,
  /// a client may have all places. A free place is for the waiting client that has the fewest, or of several
  /// for the one that has waited for the longest.
  Place take(const std::string& client);
  /// The client that has more than half of the places, and more than one, while this one waits and has less
  /// than half: it should give one back. nullopt if there is none.
  std::optional<std::string> hasTooMany(const std::string& client) const;

  std::size_t most() const;

 private:
  struct State;
  struct Held;
  const std::shared_ptr<State> state_;
};

}  // namespace scolopax::server
