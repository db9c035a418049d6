// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/render_plan.h"

#include <algorithm>
#include <chrono>

#include "renderer/data/clip_view.h"
#include "renderer/data/scene_checks.h"
#include "renderer/data/scene_view.h"

namespace scolopax {
namespace {

/// Whether the bound of all channels together is the sum of their bounds.
bool sumsExtinction(BlendMode blend) { return blend != BlendMode::max && blend != BlendMode::mix; }

/// Whether packets need the active channels of every ray: if channels hide each other, if clipping differs
/// between channels or regions, if voxels are not finite, or if an extinction depends on more than a value
/// and so may be 0 at both ends of a segment but not between them.
bool needsApart(const Scene& scene, const Volume& volume, const ChannelPlans& channels, bool clipsParts) {
  const auto& all = volume.channels();
  return (!sumsExtinction(scene.blend) && all.size() > 1) || clipsParts || channels.hasFactors() ||
         std::any_of(all.begin(), all.end(), [](const Channel& c) { return c.histogram.nonFiniteCount > 0; });
}

}  // namespace

RenderPlan::RenderPlan(std::shared_ptr<const Volume> volume, const Scene& scene, const RenderPlan* before,
                       const std::shared_ptr<MemoryBudget>& memory, const std::stop_token& stop)
    : volume_(std::move(volume)), scene_(scene) {
  const auto start = std::chrono::steady_clock::now();
  checkScene(scene_, volume_->channels().size());
  const auto rays = makeCameraRays(scene_.camera, grid(), scene_.width, scene_.height);
  channels_.emplace(volume_, scene_, before ? &*before->channels_ : nullptr, memory, stop, &rebuilt_);
  channelViews_ = channels_->views();
  const auto clip = clipView(scene_.clip, scene_.crop, grid(), visibleChannels());

  const bool apart = needsApart(scene_, *volume_, *channels_, clip && clip->parts);
  majorants_.emplace(channels_->boundedCells(), channels_->boundTables(), sumsExtinction(scene_.blend), apart,
                     before ? &*before->majorants_ : nullptr, memory, stop);
  rebuilt_.majorantCells = majorants_->cellsRebuilt();
  if (channels_->hasSurfaces()) {
    const auto* surfaceCellsBefore = before && before->surfaceCells_ ? &*before->surfaceCells_ : nullptr;
    surfaceCells_.emplace(channels_->valueCells(), channels_->presenceTables(), false, true,
                          surfaceCellsBefore, memory, stop);
  }

  view_ = sceneView(scene_, grid(), rays, clip, channelViews_);
  view_.majorants = majorants_->view();
  view_.surfaces = surfaceCells_.has_value();
  if (surfaceCells_) view_.surfaceCells = surfaceCells_->view();
  rebuilt_.rebuildMs =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace scolopax
