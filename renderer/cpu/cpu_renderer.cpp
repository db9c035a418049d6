// SPDX-License-Identifier: Apache-2.0
// The CPU backend: owns plan and film, runs the kernels over tiles with TBB.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>
#include <new>
#include <string>

#include "renderer/core/error.h"
#include "renderer/cpu/tile_kernels.h"
#include "renderer/data/film.h"
#include "renderer/data/render_plan.h"
#include "renderer/data/sampling.h"
#include "renderer/renderer.h"

namespace scolopax {
namespace {

TileFunction chooseKernel(const Scene& scene) {
  return visitIntegrator(scene,
                         [&](auto integrator) { return chooseTileFunction<decltype(integrator)>(scene); });
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
    if (stats.filmReset) resetRecords();
    return stats;
  }

  bool renderSample(const std::atomic<bool>& cancel, std::chrono::nanoseconds budget) override {
    const kernel::SceneView& scene = plan_.view();
    const Pass pass{scene,
                    sampleNumber(plan_.scene().sampling, film_.samples()),
                    film_.pass(),
                    counting_ ? cost_.data() : nullptr,
                    recording_ ? first_.pass() : nullptr,
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
      if (recording_) first_.add(plan_.visibleChannels());
      if (counting_) addCosts();
      std::fill(done_.begin(), done_.end(), std::uint8_t(0));
    });
    return complete;
  }

  std::uint32_t samples() const override { return film_.samples(); }
  double estimatedError() const override { return film_.estimatedError(); }
  Image image() const override { return film_.image(); }

  void countCosts() override {
    counting_ = true;
    resetRecords();
  }
  RenderStats stats() const override { return stats_; }

  void recordAovs() override {
    counting_ = recording_ = true;
    if (film_.pixelCount() > 0) film_.reset(film_.width(), film_.height());
    resetRecords();
  }

  AovValues aov(Aov which) const override {
    AovValues result{which, film_.width(), film_.height(), {}};
    result.values.assign(film_.pixelCount(), std::numeric_limits<float>::quiet_NaN());
    if (!recording_ || film_.samples() == 0) return result;
    switch (which) {
      case Aov::depth:
        result.values = first_.depth();
        break;
      case Aov::transmittance: {
        const Image image = film_.image();
        std::transform(image.pixels.begin(), image.pixels.end(), result.values.begin(),
                       [](const glm::vec4& p) { return 1.0f - p.a; });
        break;
      }
      case Aov::channel:
        result.values = first_.channel();
        break;
      case Aov::cost:
        std::transform(fetches_.begin(), fetches_.end(), result.values.begin(),
                       [&](std::uint64_t n) { return float(double(n) / film_.samples()); });
        break;
    }
    return result;
  }

 private:
  void resetRecords() {
    const std::size_t pixels = film_.pixelCount();
    stats_ = {};
    try {
      done_.assign(pixels, 0);
      if (counting_) cost_.assign(pixels, {});
      if (!recording_ || pixels == 0) return;
      fetches_.assign(pixels, 0);
      first_.reset(pixels, plan_.scene().channels.size());
    } catch (const std::bad_alloc&) {
      throw Error(ErrorCode::tooLarge, "image: no memory for what is recorded of " +
                                           std::to_string(film_.width()) + "x" +
                                           std::to_string(film_.height()) + " pixels");
    }
  }

  /// Moves what a pass has cost into sums that do not overflow.
  void addCosts() {
    stats_.rays += cost_.size();
    for (std::size_t i = 0; i < cost_.size(); ++i) {
      stats_.fetches += cost_[i].fetches;
      stats_.cellSteps += cost_[i].cellSteps;
      stats_.randomBlocks += cost_[i].randomBlocks;
      stats_.truncatedRays += cost_[i].truncated;
      if (recording_) fetches_[i] += cost_[i].fetches;
      cost_[i] = {};
    }
  }

  RenderPlan plan_;
  Film film_;
  std::vector<std::uint8_t> done_;  // pixels that a pass has behind it
  bool counting_ = false, recording_ = false;
  std::vector<kernel::SampleCost> cost_;  // of the pass, one per pixel while counting
  RenderStats stats_;
  std::vector<std::uint64_t> fetches_;  // one per pixel while recording
  FirstCollisions first_;
  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Renderer> makeCpuRenderer(std::shared_ptr<const Volume> volume, int threads) {
  return std::make_unique<CpuRenderer>(std::move(volume), threads);
}

}  // namespace scolopax
