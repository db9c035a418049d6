// SPDX-License-Identifier: Apache-2.0
// From a scene to exactly what a kernel needs: only visible channels, and only what changed is rebuilt. A
// plan never changes: whoever renders, picks or uploads from one holds it.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "renderer/data/bound_columns.h"
#include "renderer/data/majorant_grid.h"
#include "renderer/data/rebuild_stats.h"
#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax {

/// Share of a ray's light for which a method with a step computes lighting once.
float stratumOf(Method method);
/// Throws Error(badInput) if a side is not in 1..kMaxImageSide.
void checkImageSize(const Scene& scene);
/// Throws Error(badInput) for a light whose direction is zero, whose position or direction has no finite
/// length, or whose colour or intensity is negative or not finite.
void checkLight(const Light& light);
/// Throws Error(badInput) for a step that Scene::step does not allow.
void checkStep(double step);
/// Throws Error(badInput) if RenderPlan would refuse the scene for anything but its camera and curves.
void checkScene(const Scene& scene, const Volume& volume);

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
  bool nextTakesLong(const Scene& scene) const;
  /// Whether `scene` gives the same film as this plan.
  bool makesSamePicture(const Scene& scene) const;
  /// What had to be rebuilt because it could not be shared.
  const RebuildStats& rebuilt() const { return rebuilt_; }
  const Scene& scene() const { return scene_; }
  const std::shared_ptr<const Volume>& volume() const { return volume_; }
  const Grid& grid() const { return volume_->grid(); }
  /// Valid while the plan lives.
  const kernel::SceneView& view() const { return view_; }
  /// Index in the volume of every channel of the view.
  std::span<const int> visibleChannels() const { return channels_.visible; }

 private:
  struct ChannelPlan {
    TransferFunction transfer;
    Surfaces surfaces;
    std::optional<GradientFactor> factor;
    // Empty until the channel is first visible with these curves.
    std::optional<kernel::BoundTable> bounds;  // by value alone
    std::shared_ptr<const CellColumn> column;  // with the factor, if there is one
    bool visible(const ChannelAppearance& appearance) const;
  };
  /// What was measured of a channel's voxels beside the macrocells, once it was needed.
  struct Measured {
    std::shared_ptr<const CellColumn> spline;  // values of the cubic B-spline
    std::shared_ptr<const GradientCells> gradients;
  };
  /// Channels of a scene, and what bounds the visible ones.
  struct Channels {
    std::vector<std::optional<ChannelPlan>> plans;
    std::vector<Measured> measured;
    std::vector<int> visible;
    std::vector<int> valueColumns;  // per visible channel: column of values_ that holds its values
    std::vector<std::shared_ptr<const CellColumn>> splines;  // of the visible channels that are cubic
    std::vector<std::shared_ptr<const CellColumn>> columns;  // of those with a factor
  };
  void planChannels(const RenderPlan* before, const std::shared_ptr<MemoryBudget>& memory,
                    const std::stop_token& stop);
  void planFactors(const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop);
  std::optional<GradientFactor> factorOf(const Channel& channel, const ChannelAppearance& appearance) const;
  std::vector<kernel::BoundTable> boundTables() const;
  std::vector<kernel::BoundTable> presenceTables() const;
  bool hasSurfaces() const;
  bool needsApart(const kernel::ClipView& clip) const;
  void fillView(const kernel::CameraRays& rays, const std::optional<kernel::ClipView>& clip);

  const std::shared_ptr<const Volume> volume_;
  const Scene scene_;
  RebuildStats rebuilt_;
  std::shared_ptr<const MacrocellGrid> macrocells_;
  Channels channels_;
  std::shared_ptr<const MacrocellGrid> values_;   // macrocells with channels_.splines appended
  std::shared_ptr<const MacrocellGrid> bounded_;  // values_ with channels_.columns appended
  std::optional<MajorantGrid> majorants_;         // set by the constructor
  std::optional<MajorantGrid> surfaceCells_;      // 1 where a macrocell may hold a surface; if there are any
  std::vector<kernel::ChannelView> channelViews_;
  kernel::SceneView view_{};
};

}  // namespace scolopax
