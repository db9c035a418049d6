// SPDX-License-Identifier: Apache-2.0
// Keeps the renderers, with their films, of sessions that nobody watches, until their memory is needed. Used
// by ProgressiveRender and the memory budget.
#pragma once
#include <list>
#include <memory>
#include <mutex>

#include "renderer/renderer.h"

namespace scolopax::server {

/// Every function may be called from any thread.
class ParkedRenderers {
 public:
  /// `owner` must not have a renderer here.
  void park(const void* owner, std::shared_ptr<Renderer> renderer);
  /// The owner's renderer; null if it has been dropped.
  std::shared_ptr<Renderer> take(const void* owner);
  /// Drops the renderer that was parked first; false if there is none.
  bool dropOldest();

 private:
  struct Parked {
    const void* owner;
    std::shared_ptr<Renderer> renderer;
  };
  std::mutex mutex_;
  std::list<Parked> parked_;  ///< in the order in which they were parked
};

}  // namespace scolopax::server
