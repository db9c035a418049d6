// SPDX-License-Identifier: Apache-2.0
#include "server/fair_places.h"

#include <algorithm>
#include <list>
#include <map>
#include <mutex>
#include <utility>

namespace scolopax::server {

struct FairPlaces::State {
  struct Waiting {
    std::string client;
    TimePoint asked;  ///< the last time
  };

  State(std::size_t places, Now clock) : most(places), now(std::move(clock)) {}
  const std::size_t most;
  const Now now;
  mutable std::mutex mutex;                  ///< guards the members below
  std::map<std::string, std::size_t> taken;  ///< by the clients that have any
  std::size_t total = 0;
  std::list<Waiting> waiting;  ///< the first that was refused first

  std::size_t placesOf(const std::string& client) const {
    const auto found = taken.find(client);
    return found == taken.end() ? 0 : found->second;
  }
  auto findWaiting(const std::string& client) {
    return std::find_if(waiting.begin(), waiting.end(), [&](const Waiting& w) { return w.client == client; });
  }
  /// Number of the clients that get a place before this one.
  std::size_t ahead(const std::string& client) {
    const std::size_t mine = placesOf(client);
    std::size_t count = 0;
    bool before = true;  // has waited for longer than the client
    for (const Waiting& other : waiting) {
      if (other.client == client) {
        before = false;
        continue;
      }
      const std::size_t theirs = placesOf(other.client);
      count += theirs < mine || (theirs == mine && before);
    }
    return count;
  }
  void release(const std::string& client) {
    const std::lock_guard lock(mutex);
    const auto count = taken.find(client);
    if (--count->second == 0) taken.erase(count);
    --total;
  }
};

/// A place, once it has been taken.
struct FairPlaces::Held {
  Held(std::shared_ptr<State> given, std::string name) : state(std::move(given)), client(std::move(name)) {}
  ~Held() {
    if (taken) state->release(client);
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  const std::shared_ptr<State> state;
  const std::string client;
  bool taken = false;
};

FairPlaces::FairPlaces(std::size_t most, Now now) : state_(std::make_shared<State>(most, std::move(now))) {}

std::size_t FairPlaces::most() const { return state_->most; }

FairPlaces::Place FairPlaces::take(const std::string& client) {
  State& state = *state_;
  const auto place = std::make_shared<Held>(state_, client);  // outlives the lock
  const std::lock_guard lock(state.mutex);
  const TimePoint now = state.now();
  state.waiting.remove_if([&](const State::Waiting& w) { return w.asked + kWaiting < now; });
  const auto self = state.findWaiting(client);
  if (state.total + state.ahead(client) >= state.most) {
    if (self == state.waiting.end())
      state.waiting.push_back({client, now});
    else
      self->asked = now;
    return nullptr;
  }
  ++state.taken[client];
  ++state.total;
  place->taken = true;
  if (self != state.waiting.end()) state.waiting.erase(self);
  return place;
}

std::optional<std::string> FairPlaces::hasTooMany(const std::string& client) const {
  const State& state = *state_;
  const std::lock_guard lock(state.mutex);
  const bool waits = std::any_of(state.waiting.begin(), state.waiting.end(),
                                 [&](const State::Waiting& w) { return w.client == client; });
  if (!waits || 2 * state.placesOf(client) >= state.most) return std::nullopt;
  for (const auto& [other, count] : state.taken)
    if (other != client && count > 1 && 2 * count > state.most) return other;
  return std::nullopt;
}

}  // namespace scolopax::server
