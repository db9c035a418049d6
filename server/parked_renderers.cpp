// SPDX-License-Identifier: Apache-2.0
#include "server/parked_renderers.h"

#include <algorithm>
#include <utility>

namespace scolopax::server {

void ParkedRenderers::park(const void* owner, Parked parked) {
  const std::lock_guard lock(mutex_);
  places_.push_back({owner, std::move(parked)});
}

ParkedRenderers::Parked ParkedRenderers::take(const void* owner) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(places_.begin(), places_.end(), [&](const Place& place) { return place.owner == owner; });
  if (found == places_.end()) return {};
  Parked parked = std::move(found->parked);
  places_.erase(found);
  return parked;
}

bool ParkedRenderers::dropOldest() {
  std::list<Place> dropped;  // destroyed after the lock is released, since it may be large
  const std::lock_guard lock(mutex_);
  if (places_.empty()) return false;
  dropped.splice(dropped.end(), places_, places_.begin());
  return true;
}

std::vector<const Volume*> ParkedRenderers::volumes() const {
  const std::lock_guard lock(mutex_);
  std::vector<const Volume*> volumes;
  for (const Place& place : places_) volumes.push_back(place.parked.volume.get());
  return volumes;
}

}  // namespace scolopax::server
