// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/thumbnails.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "renderer/cpu/pass.h"
#include "renderer/cpu/ray_packets.h"
#include "renderer/cpu/sample_batch.h"
#include "renderer/data/camera.h"
#include "renderer/data/sampling.h"

namespace scolopax {
namespace {

constexpr double kSteps[] = {4, 2, 1, 0.5, 0.25, 0.125};

/// Pictures of independent samples at one step.
using Pictures = std::vector<std::vector<glm::vec4>>;
/// Lighting has noise, which more samples tell from bias.
constexpr std::uint32_t kSamples = 2, kLitSamples = 8;

class Thumbnails {
 public:
  /// `scene` says what of the plan's scene is looked at: with its light or without.
  Thumbnails(const RenderPlan& plan, const Scene& scene, int side)
      : view_(plan.view()), render_(quadratureTileFunction(scene, view_)) {
    const double longer = std::max(scene.width, scene.height);
    view_.width = std::max(1, int(std::lround(side * scene.width / longer)));
    view_.height = std::max(1, int(std::lround(side * scene.height / longer)));
    view_.rays = makeCameraRays(scene.camera, plan.grid(), view_.width, view_.height);
    view_.filterBox = false;  // both pictures of a pair through the same points
    view_.seed = 0;
    view_.sampleBatch = sampleBatchFor(fastestInstructionSet());
    step_ = view_.step / float(plan.scene().step);
    stratum_ = view_.stratum;
  }

  /// `step` in smallest spacings; strata are `finer` times thinner.
  Pictures render(double step, float finer, std::uint32_t samples) {
    Pictures pictures(samples);
    view_.step = step_ * float(step);
    view_.stratum = stratum_ / finer;
    const std::atomic<bool> never = false;
    const int tilesX = (view_.width + kTile - 1) / kTile, tilesY = (view_.height + kTile - 1) / kTile;
    for (std::uint32_t sample = 0; sample < samples; ++sample) {
      pictures[sample].resize(pixels());
      std::vector<std::uint8_t> done(pixels(), 0);
      const Pass pass{view_,
                      sampleNumber(Sampling::independent, sample),
                      pictures[sample].data(),
                      nullptr,
                      nullptr,
                      done.data(),
                      &never,
                      std::chrono::steady_clock::time_point::max()};
      tbb::parallel_for(0, tilesX * tilesY, [&](int i) { render_(pass, i % tilesX, i / tilesX); });
    }
    return pictures;
  }
  std::size_t pixels() const { return std::size_t(view_.width) * std::size_t(view_.height); }

 private:
  kernel::SceneView view_;
  TileFunction render_;
  float step_, stratum_;
};

/// RMSE of the coarse pictures' expected value, from that of an error of order 2 halving the step takes 3/4
/// away. Noise, of which each sample has its own, counts for nothing; or, `withNoise`, as it is in their
/// mean.
double errorOf(const Pictures& coarse, const Pictures& fine, bool withNoise) {
  const double n = double(coarse.size());
  double sum = 0;
  for (std::size_t i = 0; i < coarse[0].size(); ++i) {
    glm::dvec4 all(0);
    double squares = 0;
    for (std::size_t s = 0; s < coarse.size(); ++s) {
      const glm::dvec4 difference = glm::dvec4(coarse[s][i]) - glm::dvec4(fine[s][i]);
      all += difference;
      squares += glm::dot(difference, difference);
    }
    sum += withNoise ? glm::dot(all, all) / (n * n) : (glm::dot(all, all) - squares) / (n * (n - 1));
  }
  return 4.0 / 3.0 * std::sqrt(std::max(0.0, sum / (4.0 * double(coarse[0].size()))));
}

}  // namespace

double estimateBias(const RenderPlan& plan) {
  const Scene& scene = plan.scene();
  const bool lit = scene.shading || scene.shadows;
  Thumbnails thumbnails(plan, scene, lit ? kLitThumbnailSide : kThumbnailSide);
  const std::uint32_t samples = lit ? kLitSamples : kSamples;
  return errorOf(thumbnails.render(scene.step, 1, samples), thumbnails.render(scene.step / 2, 2, samples),
                 false);
}

std::optional<BiasedStep> largestStep(const RenderPlan& plan, double target) {
  Scene unlit = plan.scene();
  unlit.shading = unlit.shadows = false;
  unlit.method = Method::raymarch;
  Thumbnails thumbnails(plan, unlit, kThumbnailSide);
  Pictures coarse = thumbnails.render(kSteps[0], 1, kSamples);
  for (const double step : kSteps) {
    Pictures fine = thumbnails.render(step / 2, 1, kSamples);
    // Where bias is far below noise, its estimate may be 0 by chance.
    const double bias = errorOf(coarse, fine, true);
    if (bias <= target) return BiasedStep{step, bias};
    coarse = std::move(fine);
  }
  return std::nullopt;
}

}  // namespace scolopax
