// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/render_plan.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/data/clip_view.h"
#include "renderer/data/field_view.h"
#include "renderer/data/resolution.h"
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

/// Whether both scenes make the same film. They may differ only in the background, which is added to the
/// finished image.
bool samePicture(Scene a, const Scene& b) {
  a.background = b.background;
  return a == b;
}

/// Whether the bound of all channels together is the sum of their bounds.
bool sumsExtinction(BlendMode blend) { return blend != BlendMode::max && blend != BlendMode::mix; }

}  // namespace

void checkLight(const Light& light) {
  const double length = glm::length(light.vector);
  if (light.type != LightType::headlight && !std::isfinite(length))
    failBadInput("lights: the length of position and direction must be finite");
  if (light.type == LightType::directional && !(length > 0))
    failBadInput("lights: the direction must not be zero");
  for (const double value : {light.intensity, light.color.x, light.color.y, light.color.z})
    if (!(value >= 0 && std::isfinite(value)))
      failBadInput("lights: colour and intensity must be finite and not negative");
}

void checkStep(double step) {
  if (step != 0 && !(step >= kLeastStep && step <= 100))
    failBadInput("integrator.step: expected 0, or " + shortText(kLeastStep) + " to 100, found " +
                 shortText(step));
}

void checkScene(const Scene& scene, const Volume& volume) {
  if (scene.channels.size() != volume.channels().size())
    failBadInput("scene: expected " + std::to_string(volume.channels().size()) + " channels, found " +
                 std::to_string(scene.channels.size()));
  checkImageSize(scene);
  if (scene.lights.size() > std::size_t(kernel::kMaxLights))
    failBadInput("lights: expected at most " + std::to_string(kernel::kMaxLights) + ", found " +
                 std::to_string(scene.lights.size()));
  for (const Light& light : scene.lights) checkLight(light);
  checkClipping(scene.clip, scene.crop, volume.channels().size());
  checkStep(scene.step);
  if (scene.macrocell < 1 || scene.macrocell > 64)
    failBadInput("integrator.macrocell: expected 1 to 64, found " + std::to_string(scene.macrocell));
}

namespace {
static_assert(int(LightType::directional) == int(kernel::LightKind::directional) &&
              int(LightType::point) == int(kernel::LightKind::point) &&
              int(LightType::headlight) == int(kernel::LightKind::headlight));

/// Whether lights or shadows change what a channel looks like.
bool respondsToLight(const Scene& scene, const ChannelAppearance& channel) {
  const Material& m = channel.material;
  return channel.visible &&
         ((scene.shadows && m.ambient != 1) || (scene.shading && (m.diffuse > 0 || m.specular > 0)));
}

/// Moves a very distant point light nearer, so that the squares of its distance fit in a float. It is so far
/// away that its direction is the same for the whole box.
glm::dvec3 withinReach(const glm::dvec3& voxel, const Grid& grid) {
  constexpr double kFarthest = 1e12;
  const glm::dvec3 centre = glm::dvec3(grid.dims - 1) * 0.5, way = voxel - centre;
  const double distance = glm::length(way);
  return distance > kFarthest ? centre + way * (kFarthest / distance) : voxel;
}

/// Sets the view's matrices, and its lights in voxel space: those that shine, if any channel responds to
/// light.
void placeLights(const Scene& scene, const Grid& grid, kernel::SceneView* view) {
  const double smallest = grid.smallestSpacing();
  view->worldFromVoxel = glm::mat3(glm::dmat3(grid.worldFromVoxel) / smallest);
  view->gradientFromVoxel = glm::mat3(grid.gradientFromVoxel());
  view->smallestSpacing = float(smallest);
  view->shading = scene.shading;
  view->shadows = scene.shadows;
  view->lightCount = 0;
  if (std::none_of(scene.channels.begin(), scene.channels.end(),
                   [&](const ChannelAppearance& channel) { return respondsToLight(scene, channel); }))
    return;
  const std::vector<Light> headlight(1);
  const glm::dmat4 voxelFromWorld = glm::inverse(grid.worldFromVoxel);
  for (const Light& light : scene.lights.empty() ? headlight : scene.lights) {
    // A light without intensity affects neither the shading nor the share of light in shadow.
    if (light.color * light.intensity == glm::dvec3(0)) continue;
    kernel::LightView& v = view->lights[view->lightCount++];
    v.kind = kernel::LightKind(light.type);
    v.intensity = glm::vec3(light.color * light.intensity);
    if (light.type == LightType::point)
      v.vector = glm::vec3(withinReach(glm::dvec3(voxelFromWorld * glm::dvec4(light.vector, 1)), grid));
    else
      v.vector = glm::vec3(glm::dmat3(voxelFromWorld) * -glm::normalize(light.vector));
  }
}
}  // namespace

float stratumOf(Method method) { return method == Method::hybrid ? 1.0f / 8.0f : 1.0f / 64.0f; }

void checkImageSize(const Scene& scene) {
  if (scene.width < 1 || scene.height < 1 || scene.width > kMaxImageSide || scene.height > kMaxImageSide)
    throw Error(ErrorCode::badInput, "image: expected width and height from 1 to " +
                                         std::to_string(kMaxImageSide) + ", found " +
                                         std::to_string(scene.width) + "x" + std::to_string(scene.height));
}

namespace {
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

bool RenderPlan::nextTakesLong(const Scene& scene) const {
  // An edit may change the totals of all cells.
  constexpr std::size_t kManyIntervals = 4 << 20;
  if (macrocells_->size != scene.macrocell || macrocells_->intervals.size() > kManyIntervals) return true;
  // With a gamma, the place of a knot is found by trial.
  constexpr std::size_t kManyKnots = 2048;
  std::size_t knots = 0;
  for (std::size_t i = 0; i < scene.channels.size() && i < scene_.channels.size(); ++i)
    if (scene.channels[i] != scene_.channels[i]) knots += knotsOf(scene.channels[i]);
  if (knots > kManyKnots) return true;
  for (std::size_t i = 0; i < scene.channels.size() && i < channels_.measured.size(); ++i) {
    const Measured& measured = channels_.measured[i];
    const bool spline = scene.channels[i].interpolation == Interpolation::cubic;
    if (spline && !measured.spline) return true;
    if ((!measured.gradients || spline != (scene_.channels[i].interpolation == Interpolation::cubic)) &&
        needsGradients(volume_->channels()[i], scene.channels[i]))
      return true;
  }
  return false;
}

bool RenderPlan::makesSamePicture(const Scene& scene) const { return samePicture(scene_, scene); }

bool RenderPlan::ChannelPlan::visible(const ChannelAppearance& appearance) const {
  return appearance.visible &&
         (surfaces.any() || (!transfer.invisible() && !(factor && factor->isEverywhere(0))));
}

/// None if the factor makes no difference.
std::optional<GradientFactor> RenderPlan::factorOf(const Channel& channel,
                                                   const ChannelAppearance& appearance) const {
  if (!appearance.gradientOpacity) return std::nullopt;
  GradientFactor factor(*appearance.gradientOpacity, channel, volume_->grid());
  if (factor.isEverywhere(1) && channel.histogram.nonFiniteCount == 0) return std::nullopt;
  return factor;
}

void RenderPlan::planChannels(const RenderPlan* before, const std::shared_ptr<MemoryBudget>& memory,
                              const std::stop_token& stop) {
  const bool newCells = !before || macrocells_ != before->macrocells_;
  if (before) channels_.plans = before->channels_.plans;
  channels_.plans.resize(scene_.channels.size());
  if (!newCells) channels_.measured = before->channels_.measured;
  channels_.measured.resize(scene_.channels.size());
  for (std::size_t i = 0; i < scene_.channels.size(); ++i) {
    const Channel& channel = volume_->channels()[i];
    const ChannelAppearance& appearance = scene_.channels[i];
    std::optional<ChannelPlan>& plan = channels_.plans[i];
    Measured& measured = channels_.measured[i];
    const bool spline = appearance.interpolation == Interpolation::cubic;
    if (!newCells && spline != (before->scene_.channels[i].interpolation == Interpolation::cubic))
      measured = {};
    if (newCells || before->scene_.channels[i] != appearance) {
      TransferFunction transfer(channel, appearance);
      if (newCells || !sameExtinction(before->scene_.channels[i], appearance))
        plan = {transfer, {}, transfer.invisible() ? std::nullopt : factorOf(channel, appearance), {}, {}};
      plan->surfaces = Surfaces(channel, appearance, transfer.origin(), volume_->grid().smallestSpacing());
      plan->transfer = std::move(transfer);
    }
    if (!plan->visible(appearance)) continue;
    channels_.visible.push_back(int(i));
    if (spline) {
      if (!measured.spline)
        measured.spline = sharedSplineColumn(volume_, int(i), macrocells_->size, stop, memory);
      channels_.splines.push_back(measured.spline);
    }
    channels_.valueColumns.push_back(int(spline ? scene_.channels.size() + channels_.splines.size() - 1 : i));
    if (plan->bounds) continue;
    plan->bounds = buildBounds(spline ? measured.spline->levels : macrocells_->levels[i], plan->transfer,
                               channels_.valueColumns.back());
    ++rebuilt_.majorantChannels;
  }
}

/// Bounds the visible channels whose opacity depends on the gradient.
void RenderPlan::planFactors(const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop) {
  for (std::size_t v = 0; v < channels_.visible.size(); ++v) {
    const int i = channels_.visible[v];
    ChannelPlan& plan = *channels_.plans[std::size_t(i)];
    if (!plan.factor) continue;
    std::shared_ptr<const GradientCells>& gradients = channels_.measured[std::size_t(i)].gradients;
    if (!gradients)
      gradients = sharedGradientCells(volume_, i, macrocells_->size,
                                      scene_.channels[std::size_t(i)].interpolation, stop, memory);
    if (!plan.column)
      plan.column = buildBoundColumn(*values_, channels_.valueColumns[v], *plan.bounds, *gradients,
                                     *plan.factor, memory, stop);
    channels_.columns.push_back(plan.column);
  }
}

/// Bounds of the visible channels, by value or by an appended column.
std::vector<kernel::BoundTable> RenderPlan::boundTables() const {
  std::vector<kernel::BoundTable> tables;
  int column = int(values_->levels.size());
  for (std::size_t v = 0; v < channels_.visible.size(); ++v) {
    const ChannelPlan& plan = *channels_.plans[std::size_t(channels_.visible[v])];
    tables.push_back(plan.factor ? boundsOfExtinction(plan.column->levels, column++) : *plan.bounds);
    if (!plan.factor) tables.back().column = channels_.valueColumns[v];
  }
  return tables;
}

/// Whether the macrocells may hold surfaces of the visible channels.
std::vector<kernel::BoundTable> RenderPlan::presenceTables() const {
  std::vector<kernel::BoundTable> tables;
  for (std::size_t v = 0; v < channels_.visible.size(); ++v) {
    const int column = channels_.valueColumns[v];
    tables.push_back(buildPresence(values_->levels[std::size_t(column)],
                                   channels_.plans[std::size_t(channels_.visible[v])]->surfaces, column));
  }
  return tables;
}

bool RenderPlan::hasSurfaces() const {
  return std::any_of(channels_.visible.begin(), channels_.visible.end(),
                     [&](int i) { return channels_.plans[std::size_t(i)]->surfaces.any(); });
}

/// Whether packets need the active channels of every ray: if channels hide each other, if clipping differs
/// between channels or regions, if voxels are not finite, or if an extinction depends on more than a value
/// and so may be 0 at both ends of a segment but not between them.
bool RenderPlan::needsApart(const kernel::ClipView& clip) const {
  const auto& all = volume_->channels();
  return (!sumsExtinction(scene_.blend) && all.size() > 1) || clip.parts || !channels_.columns.empty() ||
         std::any_of(all.begin(), all.end(), [](const Channel& c) { return c.histogram.nonFiniteCount > 0; });
}

RenderPlan::RenderPlan(std::shared_ptr<const Volume> volume, const Scene& scene, const RenderPlan* before,
                       const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop)
    : volume_(std::move(volume)), scene_(scene) {
  const auto start = std::chrono::steady_clock::now();
  checkScene(scene_, *volume_);
  const auto rays = makeCameraRays(scene_.camera, volume_->grid(), scene_.width, scene_.height);
  const bool newCells = !before || before->macrocells_->size != scene_.macrocell;
  macrocells_ = newCells ? sharedMacrocells(volume_, scene_.macrocell, stop, memory) : before->macrocells_;
  if (newCells) rebuilt_.macrocellChannels = int(volume_->channels().size());
  planChannels(before, memory, stop);
  const bool sameValues = !newCells && channels_.splines == before->channels_.splines;
  values_ = sameValues ? before->values_ : withColumns(macrocells_, channels_.splines, memory, stop);
  planFactors(memory, stop);
  const bool sameColumns = sameValues && channels_.columns == before->channels_.columns;
  bounded_ = sameColumns ? before->bounded_ : withColumns(values_, channels_.columns, memory, stop);
  for (const int i : channels_.visible) {
    const ChannelPlan& plan = *channels_.plans[std::size_t(i)];
    const Channel& channel = volume_->channels()[std::size_t(i)];
    channelViews_.push_back(plan.transfer.view(channel));
    channelViews_.back().field = fieldView(channel, scene_.channels[std::size_t(i)].interpolation);
    channelViews_.back().dataFalls = channel.slope < 0;
    if (plan.factor) channelViews_.back().factor = plan.factor->view();
    plan.surfaces.addTo(channelViews_.back());
  }
  const auto clip = clipView(scene_.clip, scene_.crop, volume_->grid(), channels_.visible);
  majorants_.emplace(bounded_, boundTables(), sumsExtinction(scene_.blend),
                     needsApart(clip.value_or(kernel::ClipView{})), before ? &*before->majorants_ : nullptr,
                     memory, stop);
  rebuilt_.majorantCells = majorants_->cellsRebuilt();
  if (hasSurfaces()) {
    const auto* surfaceCellsBefore = before && before->surfaceCells_ ? &*before->surfaceCells_ : nullptr;
    surfaceCells_.emplace(values_, presenceTables(), false, true, surfaceCellsBefore, memory, stop);
  }
  fillView(rays, clip);
  rebuilt_.rebuildMs =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

void RenderPlan::fillView(const kernel::CameraRays& rays, const std::optional<kernel::ClipView>& clip) {
  placeLights(scene_, volume_->grid(), &view_);
  view_.rays = rays;
  view_.width = scene_.width;
  view_.height = scene_.height;
  view_.seed = scene_.seed;
  view_.filterWidth = scene_.filter == PixelFilter::box ? 1.0f : 0.0f;
  view_.dims = volume_->grid().dims;
  view_.clip = clip.value_or(kernel::ClipView{});
  view_.channelCount = clip ? int(channelViews_.size()) : 0;
  view_.channels = channelViews_.data();
  view_.nearest = std::any_of(channelViews_.begin(), channelViews_.end(), [](const auto& channel) {
    return channel.field.filter == kernel::Filter::nearest;
  });
  setResolution(view_, resolutionOf(scene_));
  view_.stratum = stratumOf(scene_.method);
  view_.majorants = majorants_->view();
  view_.surfaces = surfaceCells_.has_value();
  if (surfaceCells_) view_.surfaceCells = surfaceCells_->view();
}

}  // namespace scolopax
