// SPDX-License-Identifier: Apache-2.0
// Keeps the renderers, with their films, of sessions that nobody watches, until their memory is needed. Used
// by ProgressiveRender and the memory budget.
#pragma once
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "renderer/renderer.h"

namespace scolopax::server {

/// Every function may be called from any thread.
class ParkedRenderers {
 public:
  /// A renderer and the volume that it renders; both null if they have been dropped.
  struct Parked {
    std::shared_ptr<Renderer> renderer;
    std::shared_ptr<const Volume> volume;
  };
  /// `owner` must not have a renderer here.
  void park(const void* owner, Parked parked);
  Parked take(const void* owner);
  /// Drops the renderer that was parked first; false if there is none.
  bool dropOldest();
  /// The volumes that are rendered here, in the order in which their renderers were parked.
  std::vector<const Volume*> volumes() const;

 private:
  struct Place {
    const void* owner;
    Parked parked;
  };
  mutable std::mutex mutex_;
  std::list<Place> places_;  ///< in the order in which they were parked
};

}  // namespace scolopax::server
