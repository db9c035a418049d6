// SPDX-License-Identifier: Apache-2.0
// The CPU backend: owns plan and film, runs the kernels over tiles with TBB.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "renderer/cpu/tile_kernels.h"
#include "renderer/data/film.h"
#include "renderer/data/render_plan.h"
#include "renderer/data/sampling.h"
#include "renderer/renderer.h"

namespace scolopax {
namespace {

TileFunction chooseKernel(const Scene& scene) {
  switch (scene.method) {
    case Method::superposed:
      return chooseTileFunction<kernel::Analog<kernel::Superposed>>(scene);
    case Method::cumulative:
      return chooseTileFunction<kernel::Analog<kernel::Cumulative>>(scene);
    case Method::syncDda:
      return chooseTileFunction<kernel::Analog<kernel::SyncDda>>(scene);
    case Method::nDda:
      return chooseTileFunction<kernel::Analog<kernel::NDda>>(scene);
    case Method::raymarch:
      return chooseTileFunction<kernel::RayMarch>(scene);
  }
  return nullptr;
}

class CpuRenderer final : public Renderer {
 public:
  CpuRenderer(std::shared_ptr<const Volume> volume, int threads)
      : plan_(std::move(volume)), arena_(threads > 0 ? threads : tbb::task_arena::automatic) {}

  std::string_view backendName() const override { return "cpu"; }

  RebuildStats setScene(const Scene& scene) override {
    // Memory first: when there is none, plan and film stay as they were.
    Film resized;
    const bool newSize = scene.width != film_.width() || scene.height != film_.height();
    checkImageSize(scene);
    if (newSize) resized.reset(scene.width, scene.height);
    RebuildStats stats;
    arena_.execute([&] { stats = plan_.update(scene); });
    if (newSize)
      film_ = std::move(resized);
    else if (stats.filmReset)
      film_.reset(scene.width, scene.height);
    if (stats.filmReset) done_.assign(film_.pixelCount(), 0);
    if (stats.filmReset && counting_) cost_.assign(film_.pixelCount(), {});
    return stats;
  }

  bool renderSample(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) override {
    const kernel::SceneView& scene = plan_.view();
    const Pass pass{scene,
                    sampleNumber(plan_.scene().sampling, film_.samples()),
                    film_.pass(),
                    counting_ ? cost_.data() : nullptr,
                    done_.data(),
                    &cancel,
                    std::chrono::steady_clock::now() + budget};
    const TileFunction renderTileAt = chooseKernel(plan_.scene());
    const int tilesX = (scene.width + kTile - 1) / kTile, tilesY = (scene.height + kTile - 1) / kTile;
    bool complete = false;
    arena_.execute([&] {
      tbb::parallel_for(0, tilesX * tilesY, [&](int i) { renderTileAt(pass, i % tilesX, i / tilesX); });
      complete = std::find(done_.begin(), done_.end(), 0) == done_.end();
      if (!complete) return;
      film_.add();
      std::fill(done_.begin(), done_.end(), std::uint8_t(0));
    });
    return complete;
  }

  std::uint32_t samples() const override { return film_.samples(); }
  double estimatedError() const override { return film_.estimatedError(); }
  Image image() const override { return film_.image(); }

  void countCosts() override {
    counting_ = true;
    cost_.assign(film_.pixelCount(), {});
  }

  RenderStats stats() const override {
    RenderStats stats;
    stats.rays = std::uint64_t(film_.samples()) * cost_.size();
    for (const kernel::SampleCost& cost : cost_) {
      stats.fetches += cost.fetches;
      stats.cellSteps += cost.cellSteps;
      stats.randomBlocks += cost.randomBlocks;
      stats.truncatedRays += cost.truncated;
    }
    return stats;
  }

 private:
  RenderPlan plan_;
  Film film_;
  std::vector<std::uint8_t> done_;  // pixels that a pass has behind it
  bool counting_ = false;
  std::vector<kernel::SampleCost> cost_;  // one per pixel while counting
  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Renderer> makeCpuRenderer(std::shared_ptr<const Volume> volume, int threads) {
  return std::make_unique<CpuRenderer>(std::move(volume), threads);
}

}  // namespace scolopax
