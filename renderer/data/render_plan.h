// SPDX-License-Identifier: Apache-2.0
// From a scene to exactly what a kernel needs: only visible channels, and only what changed is rebuilt. A
// plan never changes: whoever renders, picks or uploads from one holds it.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "renderer/data/channel_plans.h"
#include "renderer/data/majorant_grid.h"
#include "renderer/data/rebuild_stats.h"
#include "renderer/data/scene.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/views.h"

namespace scolopax {

class RenderPlan : public std::enable_shared_from_this<RenderPlan> {
 public:
  /// `before`, if given, is a plan of the same volume; what the scene leaves unchanged is shared with it. The
  /// memory of macrocells and of what is kept per macrocell is charged to `memory`, if given. Throws
  /// Error(badInput) and, once `stop` is requested, Error(cancelled).
  RenderPlan(std::shared_ptr<const Volume> volume, const Scene& scene, const RenderPlan* before = nullptr,
             const std::shared_ptr<MemoryBudget>& memory = nullptr, const std::stop_token& stop = {});
  RenderPlan(const RenderPlan&) = delete;
  RenderPlan& operator=(const RenderPlan&) = delete;

  /// Whether building the next plan, of `scene`, would take longer than a few milliseconds.
  bool nextTakesLong(const Scene& scene) const { return channels_->nextTakesLong(scene); }
  /// What had to be rebuilt because it could not be shared.
  const RebuildStats& rebuilt() const { return rebuilt_; }
  const Scene& scene() const { return scene_; }
  const std::shared_ptr<const Volume>& volume() const { return volume_; }
  const Grid& grid() const { return volume_->grid(); }
  /// Valid while the plan lives.
  const kernel::SceneView& view() const { return view_; }
  /// Index in the volume of every channel of the view.
  std::span<const int> visibleChannels() const { return channels_->visible(); }

 private:
  const std::shared_ptr<const Volume> volume_;
  const Scene scene_;
  RebuildStats rebuilt_;
  std::optional<ChannelPlans> channels_;  // set by the constructor, like majorants_
  std::optional<MajorantGrid> majorants_;
  std::optional<MajorantGrid> surfaceCells_;  // 1 where a macrocell may hold a surface; if there are any
  std::vector<kernel::ChannelView> channelViews_;
  kernel::SceneView view_{};
};

}  // namespace scolopax
