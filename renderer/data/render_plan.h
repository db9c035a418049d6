// SPDX-License-Identifier: Apache-2.0
// From scene to what a kernel needs and nothing else: only channels that can be seen, only what changed
// rebuilt. Every backend owns one; the launcher uploads or borrows its view.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "renderer/data/bound_columns.h"
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
  std::span<const int> visibleChannels() const { return channels_.visible; }

 private:
  struct ChannelPlan {
    TransferFunction transfer;
    std::optional<GradientFactor> factor;
    // None as long as the channel has not been visible with these curves.
    std::optional<kernel::BoundTable> bounds;   // by value alone
    std::shared_ptr<const BoundColumn> column;  // with the factor, if there is one
    bool visible(const ChannelAppearance& appearance) const;
  };
  /// Channels of a scene, and what bounds the visible ones.
  struct Channels {
    std::vector<std::optional<ChannelPlan>> plans;
    std::vector<int> visible;
    std::vector<kernel::BoundTable> tables;
    std::vector<std::shared_ptr<const BoundColumn>> columns;
    std::vector<std::shared_ptr<const GradientCells>> gradients;  // per channel, once they were needed
  };
  Channels planChannels(const Scene& scene, const MacrocellGrid& macrocells, const std::stop_token& stop,
                        RebuildStats* stats) const;
  std::optional<GradientFactor> factorOf(const Channel& channel, const ChannelAppearance& appearance) const;
  bool needsApart(const Scene& scene, const Channels& channels, const kernel::ClipView& clip) const;
  void fillView(const Scene& scene, const kernel::CameraRays& rays,
                const std::optional<kernel::ClipView>& clip);

  std::shared_ptr<const Volume> volume_;
  const std::shared_ptr<MemoryBudget> memory_;
  std::optional<Scene> scene_;
  std::shared_ptr<const MacrocellGrid> macrocells_;
  Channels channels_;
  std::shared_ptr<const MacrocellGrid> bounded_;  // macrocells with the columns of channels
  MemoryBudget::Share majorantMemory_;
  MajorantGrid majorants_;
  std::vector<kernel::ChannelView> channelViews_;
  kernel::SceneView view_{};
};

}  // namespace scolopax
