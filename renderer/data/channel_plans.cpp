// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/channel_plans.h"

#include <algorithm>
#include <utility>

#include "renderer/data/field_view.h"
#include "renderer/data/shared_macrocells.h"

namespace scolopax {
namespace {

static_assert(kMaxChannels <= kernel::kMaxVisibleChannels);

/// Whether two appearances give the same voxels the same extinction, on which the bounds depend.
bool sameExtinction(const ChannelAppearance& a, const ChannelAppearance& b) {
  return a.rangeLo == b.rangeLo && a.rangeHi == b.rangeHi && a.gamma == b.gamma && a.density == b.density &&
         a.opacity == b.opacity && a.gradientOpacity == b.gradientOpacity && a.peaks == b.peaks &&
         a.interpolation == b.interpolation;
}

/// Whether the bounds of a channel depend on its gradients. The same decision as factorOf() and visible()
/// make, for any appearance.
bool needsGradients(const Channel& channel, const ChannelAppearance& appearance) {
  if (!appearance.visible || !(appearance.density > 0) || !appearance.gradientOpacity ||
      appearance.peaks == Peaks::only)
    return false;
  const auto& factor = appearance.gradientOpacity->factor;
  const auto any = [](const std::vector<OpacityKnot>& knots, auto&& is) {
    return std::any_of(knots.begin(), knots.end(), [&](const OpacityKnot& knot) { return is(knot.value); });
  };
  const auto isAboveZero = [](double value) { return value > 0; };
  return any(appearance.opacity, isAboveZero) && any(factor, isAboveZero) &&
         (channel.histogram.nonFiniteCount > 0 || any(factor, [](double value) { return value != 1; }));
}

/// Knots of all curves.
std::size_t knotsOf(const ChannelAppearance& look) {
  return look.opacity.size() + look.color.size() +
         (look.gradientOpacity ? look.gradientOpacity->factor.size() : 0);
}

}  // namespace

ChannelPlans::ChannelPlans(std::shared_ptr<const Volume> volume, const Scene& scene,
                           const ChannelPlans* before, const std::shared_ptr<MemoryBudget>& memory,
                           const std::stop_token& stop, RebuildStats* rebuilt)
    : volume_(std::move(volume)), appearances_(scene.channels) {
  // Bounds, and what is measured for them, are per macrocell.
  if (before && before->macrocells_->size != scene.macrocell) before = nullptr;
  if (before) {
    macrocells_ = before->macrocells_;
    plans_ = before->plans_;
    measured_ = before->measured_;
  } else {
    macrocells_ = sharedMacrocells(volume_, scene.macrocell, stop, memory);
    plans_.resize(appearances_.size());
    measured_.resize(appearances_.size());
    rebuilt->macrocellChannels += int(volume_->channels().size());
  }
  for (std::size_t i = 0; i < appearances_.size(); ++i) {
    planCurves(i, before);
    if (plans_[i]->visible(appearances_[i])) addVisible(i, memory, stop, rebuilt);
  }
  const bool sameValues = before && splineColumns_ == before->splineColumns_;
  values_ = sameValues ? before->values_ : withColumns(macrocells_, splineColumns_, memory, stop);
  boundFactors(memory, stop);
  const bool sameBounds = sameValues && factorColumns_ == before->factorColumns_;
  bounded_ = sameBounds ? before->bounded_ : withColumns(values_, factorColumns_, memory, stop);
}

bool ChannelPlans::nextTakesLong(const Scene& scene) const {
  // An edit may change the totals of all cells.
  constexpr std::size_t kManyIntervals = 4 << 20;
  if (macrocells_->size != scene.macrocell || macrocells_->intervals.size() > kManyIntervals) return true;
  const std::size_t count = std::min(scene.channels.size(), appearances_.size());
  // With a gamma, the stored value of a knot is found by trial.
  constexpr std::size_t kManyKnots = 2048;
  std::size_t knots = 0;
  for (std::size_t i = 0; i < count; ++i)
    if (scene.channels[i] != appearances_[i]) knots += knotsOf(scene.channels[i]);
  if (knots > kManyKnots) return true;
  for (std::size_t i = 0; i < count; ++i) {
    const bool spline = scene.channels[i].interpolation == Interpolation::cubic;
    if (spline && !measured_[i].spline) return true;
    if ((!measured_[i].gradients || spline != isSpline(i)) &&
        needsGradients(volume_->channels()[i], scene.channels[i]))
      return true;
  }
  return false;
}

bool ChannelPlans::ChannelPlan::visible(const ChannelAppearance& appearance) const {
  return appearance.visible &&
         (surfaces.any() || (!transfer.invisible() && !(factor && factor->isEverywhere(0))));
}

/// None if the factor makes no difference.
std::optional<GradientFactor> ChannelPlans::factorOf(std::size_t i) const {
  const Channel& channel = volume_->channels()[i];
  const auto& gradientOpacity = appearances_[i].gradientOpacity;
  if (!gradientOpacity) return std::nullopt;
  GradientFactor factor(*gradientOpacity, channel, volume_->grid());
  if (factor.isEverywhere(1) && channel.histogram.nonFiniteCount == 0) return std::nullopt;
  return factor;
}

/// Rebuilds what differs from the plan before, and drops what was measured for another interpolation.
void ChannelPlans::planCurves(std::size_t i, const ChannelPlans* before) {
  const Channel& channel = volume_->channels()[i];
  const ChannelAppearance& appearance = appearances_[i];
  std::optional<ChannelPlan>& plan = plans_[i];
  if (before && isSpline(i) != before->isSpline(i)) measured_[i] = {};
  if (before && before->appearances_[i] == appearance) return;
  TransferFunction transfer(channel, appearance);
  if (!before || !sameExtinction(before->appearances_[i], appearance))
    plan = {transfer, {}, transfer.invisible() ? std::nullopt : factorOf(i), {}, {}};
  plan->surfaces = Surfaces(channel, appearance, transfer.origin(), volume_->grid().smallestSpacing());
  plan->transfer = std::move(transfer);
}

/// Appends a channel to the visible ones, and bounds its extinction by value.
void ChannelPlans::addVisible(std::size_t i, const std::shared_ptr<MemoryBudget>& memory,
                              const std::stop_token& stop, RebuildStats* rebuilt) {
  ChannelPlan& plan = *plans_[i];
  Measured& measured = measured_[i];
  visible_.push_back(int(i));
  valueColumns_.push_back(int(i));
  if (isSpline(i)) {
    if (!measured.spline)
      measured.spline = sharedSplineColumn(volume_, int(i), macrocells_->size, stop, memory);
    valueColumns_.back() = int(appearances_.size() + splineColumns_.size());
    splineColumns_.push_back(measured.spline);
  }
  if (plan.bounds) return;
  plan.bounds = buildBounds(isSpline(i) ? measured.spline->levels : macrocells_->levels[i], plan.transfer,
                            valueColumns_.back());
  ++rebuilt->majorantChannels;
}

/// Bounds the visible channels whose opacity depends on the gradient.
void ChannelPlans::boundFactors(const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop) {
  for (std::size_t v = 0; v < visible_.size(); ++v) {
    const auto i = std::size_t(visible_[v]);
    ChannelPlan& plan = *plans_[i];
    if (!plan.factor) continue;
    std::shared_ptr<const GradientCells>& gradients = measured_[i].gradients;
    if (!gradients)
      gradients = sharedGradientCells(volume_, int(i), macrocells_->size, appearances_[i].interpolation, stop,
                                      memory);
    if (!plan.column)
      plan.column =
          buildBoundColumn(*values_, valueColumns_[v], *plan.bounds, *gradients, *plan.factor, memory, stop);
    factorColumns_.push_back(plan.column);
  }
}

std::vector<kernel::ChannelView> ChannelPlans::views() const {
  std::vector<kernel::ChannelView> views;
  for (std::size_t v = 0; v < visible_.size(); ++v) {
    const auto i = std::size_t(visible_[v]);
    const ChannelPlan& plan = visiblePlan(v);
    const Channel& channel = volume_->channels()[i];
    kernel::ChannelView& view = views.emplace_back(plan.transfer.view(channel));
    view.field = fieldView(channel, appearances_[i].interpolation);
    view.dataFalls = channel.slope < 0;
    if (plan.factor) view.factor = plan.factor->view();
    plan.surfaces.addTo(view);
  }
  return views;
}

std::vector<kernel::BoundTable> ChannelPlans::boundTables() const {
  std::vector<kernel::BoundTable> tables;
  int column = int(values_->levels.size());
  for (std::size_t v = 0; v < visible_.size(); ++v) {
    const ChannelPlan& plan = visiblePlan(v);
    tables.push_back(plan.factor ? boundsOfExtinction(plan.column->levels, column++) : *plan.bounds);
    if (!plan.factor) tables.back().column = valueColumns_[v];
  }
  return tables;
}

std::vector<kernel::BoundTable> ChannelPlans::presenceTables() const {
  std::vector<kernel::BoundTable> tables;
  for (std::size_t v = 0; v < visible_.size(); ++v) {
    const int column = valueColumns_[v];
    tables.push_back(buildPresence(values_->levels[std::size_t(column)], visiblePlan(v).surfaces, column));
  }
  return tables;
}

bool ChannelPlans::hasSurfaces() const {
  return std::any_of(visible_.begin(), visible_.end(),
                     [&](int i) { return plans_[std::size_t(i)]->surfaces.any(); });
}

}  // namespace scolopax
