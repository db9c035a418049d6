// SPDX-License-Identifier: Apache-2.0
#include "server/parked_renderers.h"

#include <algorithm>
#include <utility>

namespace scolopax::server {

void ParkedRenderers::park(const void* owner, std::shared_ptr<Renderer> renderer) {
  const std::lock_guard lock(mutex_);
  parked_.push_back({owner, std::move(renderer)});
}

std::shared_ptr<Renderer> ParkedRenderers::take(const void* owner) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(parked_.begin(), parked_.end(),
                                  [&](const Parked& parked) { return parked.owner == owner; });
  if (found == parked_.end()) return nullptr;
  auto renderer = std::move(found->renderer);
  parked_.erase(found);
  return renderer;
}

bool ParkedRenderers::dropOldest() {
  std::list<Parked> dropped;  // destroyed after the lock is released, since it may be large
  const std::lock_guard lock(mutex_);
  if (parked_.empty()) return false;
  dropped.splice(dropped.end(), parked_, parked_.begin());
  return true;
}

}  // namespace scolopax::server
