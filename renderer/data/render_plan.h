// SPDX-License-Identifier: Apache-2.0
// From scene to what a kernel needs and nothing else: only channels that can be seen, only what changed
// rebuilt. A plan never changes: who renders, picks or uploads from one holds it.
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
/// Throws Error(badInput) where a plan of the scene would be refused for anything but its camera and curves.
void checkScene(const Scene& scene, const Volume& volume);

class RenderPlan {
 public:
  /// Throws Error(badInput) and, once `stop` is requested, Error(cancelled). What the scene leaves as it was
  /// in `before`, if that is given, is shared with it: of the same volume. Macrocells and what is kept of
  /// each are of the budget of memory.
  RenderPlan(std::shared_ptr<const Volume> volume, const Scene& scene, const RenderPlan* before = nullptr,
             const std::shared_ptr<MemoryBudget>& memory = nullptr, const std::stop_token& stop = {});
  RenderPlan(const RenderPlan&) = delete;
  RenderPlan& operator=(const RenderPlan&) = delete;

  /// Whether a plan of this scene after this one takes longer than a few milliseconds.
  bool nextTakesLong(const Scene& scene) const;
  /// Whether a film of this plan is one of that scene.
  bool makesSamePicture(const Scene& scene) const;
  /// What had to be done that was not shared.
  const RebuildStats& rebuilt() const { return rebuilt_; }
  const Scene& scene() const { return scene_; }
  const Grid& grid() const { return volume_->grid(); }
  /// Valid while the plan lives.
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
    std::vector<std::shared_ptr<const BoundColumn>> columns;
    std::vector<std::shared_ptr<const GradientCells>> gradients;  // per channel, once they were needed
  };
  void planChannels(const RenderPlan* before, const std::shared_ptr<MemoryBudget>& memory,
                    const std::stop_token& stop);
  std::optional<GradientFactor> factorOf(const Channel& channel, const ChannelAppearance& appearance) const;
  std::vector<kernel::BoundTable> boundTables() const;
  bool needsApart(const kernel::ClipView& clip) const;
  void fillView(const kernel::CameraRays& rays, const std::optional<kernel::ClipView>& clip);

  const std::shared_ptr<const Volume> volume_;
  const Scene scene_;
  RebuildStats rebuilt_;
  std::shared_ptr<const MacrocellGrid> macrocells_;
  Channels channels_;
  std::shared_ptr<const MacrocellGrid> bounded_;  // macrocells with the columns of channels
  std::optional<MajorantGrid> majorants_;         // always, once it is made
  std::vector<kernel::ChannelView> channelViews_;
  kernel::SceneView view_{};
};

}  // namespace scolopax
