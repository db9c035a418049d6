// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/render_plan.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "renderer/core/error.h"
#include "renderer/core/short_text.h"
#include "renderer/data/clip_view.h"
#include "renderer/data/shared_macrocells.h"

namespace scolopax {
namespace {

static_assert(kMaxChannels <= kernel::kMaxVisibleChannels);

/// Whether the same voxels have the same extinction: what bounds depend on.
bool sameExtinction(const ChannelAppearance& a, const ChannelAppearance& b) {
  return a.rangeLo == b.rangeLo && a.rangeHi == b.rangeHi && a.gamma == b.gamma && a.density == b.density &&
         a.opacity == b.opacity && a.gradientOpacity == b.gradientOpacity;
}

/// Whether both scenes make the same film: everything but the background, which is added to the finished
/// image.
bool samePicture(Scene a, const Scene& b) {
  a.background = b.background;
  return a == b;
}

/// Whether the bound of all channels together is the sum of theirs.
bool sumsExtinction(BlendMode blend) { return blend != BlendMode::max && blend != BlendMode::mix; }

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorCode::badInput, what); }

}  // namespace

void checkLight(const Light& light) {
  const double length = glm::length(light.vector);
  if (light.type != LightType::headlight && !std::isfinite(length))
    fail("lights: the length of position and direction must be finite");
  if (light.type == LightType::directional && !(length > 0)) fail("lights: the direction must not be zero");
  for (const double value : {light.intensity, light.color.x, light.color.y, light.color.z})
    if (!(value >= 0 && std::isfinite(value)))
      fail("lights: colour and intensity must be finite and not negative");
}

void checkScene(const Scene& scene, const Volume& volume) {
  if (scene.channels.size() != volume.channels().size())
    fail("scene: expected " + std::to_string(volume.channels().size()) + " channels, found " +
         std::to_string(scene.channels.size()));
  checkImageSize(scene);
  if (scene.lights.size() > std::size_t(kernel::kMaxLights))
    fail("lights: at most " + std::to_string(kernel::kMaxLights) + " are possible, found " +
         std::to_string(scene.lights.size()));
  for (const Light& light : scene.lights) checkLight(light);
  checkClipping(scene.clip, scene.crop, volume.channels().size());
  if (!(scene.step >= 0.01 && scene.step <= 100))
    fail("integrator.step: expected 0.01 to 100, found " + shortText(scene.step));
  if (scene.macrocell < 1 || scene.macrocell > 64)
    fail("integrator.macrocell: expected 1 to 64, found " + std::to_string(scene.macrocell));
}

namespace {
static_assert(int(LightType::directional) == int(kernel::LightKind::directional) &&
              int(LightType::point) == int(kernel::LightKind::point) &&
              int(LightType::headlight) == int(kernel::LightKind::headlight));

/// Whether lights and shadows make any difference to what a channel shows.
bool respondsToLight(const Scene& scene, const ChannelAppearance& channel) {
  const Material& m = channel.material;
  return channel.visible &&
         ((scene.shadows && m.ambient != 1) || (scene.shading && (m.diffuse > 0 || m.specular > 0)));
}

/// A point light so far away that it is the same direction for the whole box, moved to where the squares of
/// its distance are floats.
glm::dvec3 withinReach(const glm::dvec3& voxel, const Grid& grid) {
  constexpr double kFarthest = 1e12;
  const glm::dvec3 centre = glm::dvec3(grid.dims - 1) * 0.5, way = voxel - centre;
  const double distance = glm::length(way);
  return distance > kFarthest ? centre + way * (kFarthest / distance) : voxel;
}

/// Lights to voxel space: those that shine, if there is anything that shows it.
void placeLights(const Scene& scene, const Grid& grid, kernel::SceneView* view) {
  const double smallest = grid.smallestSpacing();
  view->worldFromVoxel = glm::mat3(glm::dmat3(grid.worldFromVoxel) / smallest);
  view->gradientFromVoxel = glm::mat3(grid.gradientFromVoxel());
  view->smallestSpacing = float(smallest);
  view->lightCount = 0;
  if (std::none_of(scene.channels.begin(), scene.channels.end(),
                   [&](const ChannelAppearance& channel) { return respondsToLight(scene, channel); }))
    return;
  const std::vector<Light> headlight(1);
  const glm::dmat4 voxelFromWorld = glm::inverse(grid.worldFromVoxel);
  for (const Light& light : scene.lights.empty() ? headlight : scene.lights) {
    // One without intensity has no part in shading nor in the share of light that is in shadow.
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
    throw Error(ErrorCode::badInput, "image: width and height must be from 1 to " +
                                         std::to_string(kMaxImageSide) + ", found " +
                                         std::to_string(scene.width) + "x" + std::to_string(scene.height));
}

namespace {
/// Whether the bounds of a channel depend on its gradients; as factorOf() and visible(), of any appearance.
bool needsGradients(const Channel& channel, const ChannelAppearance& appearance) {
  if (!appearance.visible || !(appearance.density > 0) || !appearance.gradientOpacity) return false;
  const auto& factor = appearance.gradientOpacity->factor;
  const auto any = [](const std::vector<OpacityKnot>& knots, auto&& is) {
    return std::any_of(knots.begin(), knots.end(), [&](const OpacityKnot& knot) { return is(knot.value); });
  };
  const auto isAboveZero = [](double value) { return value > 0; };
  return any(appearance.opacity, isAboveZero) && any(factor, isAboveZero) &&
         (channel.histogram.nonFiniteCount > 0 || any(factor, [](double value) { return value != 1; }));
}
}  // namespace

bool RenderPlan::takesLong(const Scene& scene) const {
  // An edit may change the totals of all cells.
  constexpr std::size_t kManyIntervals = 4 << 20;
  if (!macrocells_ || macrocells_->size != scene.macrocell || macrocells_->intervals.size() > kManyIntervals)
    return true;
  for (std::size_t i = 0; i < scene.channels.size() && i < channels_.gradients.size(); ++i)
    if (!channels_.gradients[i] && needsGradients(volume_->channels()[i], scene.channels[i])) return true;
  return false;
}

bool RenderPlan::makesSamePicture(const Scene& scene) const { return scene_ && samePicture(*scene_, scene); }

bool RenderPlan::ChannelPlan::visible(const ChannelAppearance& appearance) const {
  return appearance.visible && !transfer.invisible() && !(factor && factor->isEverywhere(0));
}

/// None where it makes no difference.
std::optional<GradientFactor> RenderPlan::factorOf(const Channel& channel,
                                                   const ChannelAppearance& appearance) const {
  if (!appearance.gradientOpacity) return std::nullopt;
  GradientFactor factor(*appearance.gradientOpacity, channel, volume_->grid());
  if (factor.isEverywhere(1) && channel.histogram.nonFiniteCount == 0) return std::nullopt;
  return factor;
}

RenderPlan::Channels RenderPlan::planChannels(const Scene& scene, const MacrocellGrid& macrocells,
                                              const std::stop_token& stop, RebuildStats* stats) const {
  const bool newCells = &macrocells != macrocells_.get();
  Channels next;
  next.plans = channels_.plans;
  next.plans.resize(scene.channels.size());
  if (!newCells) next.gradients = channels_.gradients;
  next.gradients.resize(scene.channels.size());
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    const Channel& channel = volume_->channels()[i];
    const ChannelAppearance& appearance = scene.channels[i];
    std::optional<ChannelPlan>& plan = next.plans[i];
    const bool stale = newCells || !scene_ || !sameExtinction(scene_->channels[i], appearance);
    if (stale)
      plan = {TransferFunction(channel, appearance), factorOf(channel, appearance), {}, {}};
    else if (scene_->channels[i] != appearance)
      plan->transfer = TransferFunction(channel, appearance);
    if (!plan->visible(appearance)) continue;
    if (!plan->bounds) {
      plan->bounds = buildBounds(macrocells.levels[i], plan->transfer, int(i));
      ++stats->majorantChannels;
    }
    next.visible.push_back(int(i));
    if (!plan->factor) {
      next.tables.push_back(*plan->bounds);
      continue;
    }
    if (!next.gradients[i])
      next.gradients[i] = sharedGradientCells(volume_, int(i), macrocells.size, stop, memory_);
    if (!plan->column) {
      const auto share = MemoryBudget::take(memory_, MemoryUse::grids, bytesToBuildBoundColumn(macrocells));
      plan->column = std::make_shared<BoundColumn>(
          buildBoundColumn(macrocells, int(i), *plan->bounds, *next.gradients[i], *plan->factor));
    }
    next.tables.push_back(
        boundsOfExtinction(plan->column->levels, int(macrocells.levels.size() + next.columns.size())));
    next.columns.push_back(plan->column);
  }
  return next;
}

/// Whether packets need to know every ray's channels: where channels hide each other, where clipping differs
/// between channels or regions, where voxels are not finite, and where an extinction depends on more than a
/// value, so that it may be 0 at both ends of a segment and not between them.
bool RenderPlan::needsApart(const Scene& scene, const Channels& channels,
                            const kernel::ClipView& clip) const {
  const auto& all = volume_->channels();
  return (!sumsExtinction(scene.blend) && all.size() > 1) || clip.parts || !channels.columns.empty() ||
         std::any_of(all.begin(), all.end(), [](const Channel& c) { return c.histogram.nonFiniteCount > 0; });
}

RebuildStats RenderPlan::update(const Scene& scene, const std::stop_token& stop) {
  const auto start = std::chrono::steady_clock::now();
  checkScene(scene, *volume_);
  RebuildStats stats;
  stats.filmReset = !makesSamePicture(scene);
  const auto rays = makeCameraRays(scene.camera, volume_->grid(), scene.width, scene.height);

  // Everything that can throw comes first and into new objects; the plan is replaced at the end.
  const bool newCells = !macrocells_ || macrocells_->size != scene.macrocell;
  const auto macrocells = newCells ? sharedMacrocells(volume_, scene.macrocell, stop, memory_) : macrocells_;
  if (newCells) stats.macrocellChannels = int(volume_->channels().size());
  Channels channels = planChannels(scene, *macrocells, stop, &stats);
  const auto clip = clipView(scene.clip, scene.crop, volume_->grid(), channels.visible);

  const std::size_t columnBytes = channels.columns.size() * macrocells->cellCount();
  const std::size_t bytes = MajorantGrid::sizeBytes(*macrocells) +
                            (columnBytes == 0 ? 0 : macrocells->sizeBytes() + 3 * columnBytes);
  auto majorantMemory = MemoryBudget::take(memory_, MemoryUse::grids);
  const bool otherMemory = bytes != majorantMemory_.bytes();
  if (otherMemory) majorantMemory.resize(bytes);
  const bool sameColumns = !newCells && channels.columns == channels_.columns;
  auto bounded = sameColumns ? bounded_ : withColumns(macrocells, channels.columns);
  std::vector<kernel::ChannelView> views;
  views.reserve(channels.visible.size());
  for (const int i : channels.visible) {
    const ChannelPlan& plan = *channels.plans[std::size_t(i)];
    views.push_back(plan.transfer.view(volume_->channels()[std::size_t(i)]));
    if (plan.factor) views.back().gradient = plan.factor->view();
  }
  std::optional<Scene> next = scene;
  stats.majorantCells = majorants_.update(bounded, std::move(channels.tables), sumsExtinction(scene.blend),
                                          needsApart(scene, channels, clip.value_or(kernel::ClipView{})));

  scene_ = std::move(next);
  macrocells_ = macrocells;
  bounded_ = std::move(bounded);
  if (otherMemory) majorantMemory_ = std::move(majorantMemory);
  channels_ = std::move(channels);
  channelViews_ = std::move(views);
  fillView(scene, rays, clip);
  stats.rebuildMs =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return stats;
}

void RenderPlan::fillView(const Scene& scene, const kernel::CameraRays& rays,
                          const std::optional<kernel::ClipView>& clip) {
  placeLights(scene, volume_->grid(), &view_);
  view_.rays = rays;
  view_.width = scene.width;
  view_.height = scene.height;
  view_.seed = scene.seed;
  view_.filterBox = scene.filter == PixelFilter::box;
  view_.dims = volume_->grid().dims;
  view_.clip = clip.value_or(kernel::ClipView{});
  view_.channelCount = clip ? int(channelViews_.size()) : 0;
  view_.channels = channelViews_.data();
  view_.step = view_.smallestSpacing * float(scene.step);
  view_.stratum = stratumOf(scene.method);
  view_.majorants = majorants_.view();
}

}  // namespace scolopax
