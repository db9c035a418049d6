// SPDX-License-Identifier: Apache-2.0
// The part of a render plan that concerns channels: their curves, surfaces and gradient factors, and what
// bounds their extinction in macrocells. An edit rebuilds only what it changes.
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

class ChannelPlans {
 public:
  /// Borrows `scene`. `before`, if given, are the plans of another scene for the same volume; what is
  /// unchanged is shared with them. Adds to `rebuilt` what is not. Memory and errors are as for RenderPlan.
  ChannelPlans(std::shared_ptr<const Volume> volume, const Scene& scene, const ChannelPlans* before,
               const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop,
               RebuildStats* rebuilt);
  ChannelPlans(const ChannelPlans&) = delete;
  ChannelPlans& operator=(const ChannelPlans&) = delete;

  /// Whether planning the channels of `scene` next would take longer than a few milliseconds.
  bool nextTakesLong(const Scene& scene) const;

  /// Index in the volume of every visible channel. All lists below have one entry for each of them.
  std::span<const int> visible() const { return visible_; }
  /// Valid while this object lives.
  std::vector<kernel::ChannelView> views() const;
  /// Bounds of the extinction, for columns of boundedCells().
  std::vector<kernel::BoundTable> boundTables() const;
  /// Whether macrocells may hold surfaces of the channel, for columns of valueCells().
  std::vector<kernel::BoundTable> presenceTables() const;

  /// The macrocells, with a column of its own for each visible channel that is interpolated by the cubic
  /// B-spline, which reads more voxels than those of a macrocell.
  const std::shared_ptr<const MacrocellGrid>& valueCells() const { return values_; }
  /// The same, with a column for each visible channel whose extinction depends on more than its value.
  const std::shared_ptr<const MacrocellGrid>& boundedCells() const { return bounded_; }

  /// Whether any visible channel has surfaces.
  bool hasSurfaces() const;
  /// Whether the extinction of any visible channel depends on more than its value.
  bool hasFactors() const { return !factorColumns_.empty(); }

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

  bool isSpline(std::size_t channel) const {
    return appearances_[channel].interpolation == Interpolation::cubic;
  }
  const ChannelPlan& visiblePlan(std::size_t v) const { return *plans_[std::size_t(visible_[v])]; }
  std::optional<GradientFactor> factorOf(std::size_t channel) const;
  void planCurves(std::size_t channel, const ChannelPlans* before);
  void addVisible(std::size_t channel, const std::shared_ptr<MemoryBudget>& memory,
                  const std::stop_token& stop, RebuildStats* rebuilt);
  void boundFactors(const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop);

  const std::shared_ptr<const Volume> volume_;
  const std::vector<ChannelAppearance>& appearances_;
  std::shared_ptr<const MacrocellGrid> macrocells_;
  // Per channel of the volume.
  std::vector<std::optional<ChannelPlan>> plans_;
  std::vector<Measured> measured_;
  // Of the visible channels.
  std::vector<int> visible_;
  std::vector<int> valueColumns_;                                 // the column of values_ that holds them
  std::vector<std::shared_ptr<const CellColumn>> splineColumns_;  // of those that are cubic
  std::vector<std::shared_ptr<const CellColumn>> factorColumns_;  // of those with a factor
  std::shared_ptr<const MacrocellGrid> values_;                   // macrocells_ and splineColumns_
  std::shared_ptr<const MacrocellGrid> bounded_;                  // values_ and factorColumns_
};

}  // namespace scolopax
