// SPDX-License-Identifier: Apache-2.0
// From scene to what a kernel needs and nothing else: only channels that can be seen, only what changed
// rebuilt. Every backend owns one; the launcher uploads or borrows its view.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "renderer/data/majorant_grid.h"
#include "renderer/renderer.h"

namespace scolopax {

/// Share of a ray's light for which a method that has a step works out lighting once.
float stratumOf(Method method);
/// Throws Error(badInput) when a side is not in 1..kMaxImageSide.
void checkImageSize(const Scene& scene);
/// Throws Error(badInput) for a light whose numbers cannot be worked with.
void checkLight(const Light& light);
/// Throws Error(badInput) when update() would refuse the scene for anything but its camera and curves.
void checkScene(const Scene& scene, const Volume& volume);

class RenderPlan {
 public:
  explicit RenderPlan(std::shared_ptr<const Volume> volume, std::shared_ptr<MemoryBudget> memory = nullptr)
      : volume_(std::move(volume)), memory_(std::move(memory)) {}
  /// Redoes what the new scene makes stale. The plan is unchanged when this throws, Error(badInput) or, once
  /// `stop` is requested, Error(cancelled). Macrocells and what is kept of each are of the budget of memory.
  RebuildStats update(const Scene& scene, const std::stop_token& stop = {});
  /// Whether that takes longer than a few milliseconds.
  bool takesLong(const Scene& scene) const;
  /// Whether update() would leave the film as it is.
  bool makesSamePicture(const Scene& scene) const;
  const Scene& scene() const { return *scene_; }
  const std::shared_ptr<const Volume>& volume() const { return volume_; }
  const Grid& grid() const { return volume_->grid(); }
  /// Valid until the next update.
  const kernel::SceneView& view() const { return view_; }
  /// Index in the volume of every channel of the view.
  std::span<const int> visibleChannels() const { return visibleChannels_; }

 private:
  struct ChannelPlan {
    TransferFunction transfer;
    std::optional<kernel::BoundTable> bounds;  // none as long as the channel has never been seen so
  };
  std::shared_ptr<const Volume> volume_;
  const std::shared_ptr<MemoryBudget> memory_;
  std::optional<Scene> scene_;
  std::shared_ptr<const MacrocellGrid> macrocells_;
  std::vector<std::optional<ChannelPlan>> channels_;
  MemoryBudget::Share majorantMemory_;
  MajorantGrid majorants_;
  std::vector<kernel::ChannelView> channelViews_;
  std::vector<int> visibleChannels_;
  kernel::SceneView view_{};
};

}  // namespace scolopax
