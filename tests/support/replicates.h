// SPDX-License-Identifier: Apache-2.0
// Independent pictures of one scene: each has its own seed, which scrambles the low-discrepancy points
// differently. Their spread shows how large the noise is; agreement.h compares them.
#pragma once
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/data/film.h"
#include "renderer/data/render_plan.h"
#include "renderer/data/sampling.h"
#include "renderer/engine/corrections.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/render_pixel.h"
#include "tests/support/statistics.h"

namespace scolopax::test {

inline constexpr int kReplicates = 32;
/// Samples of a replicate, but for statisticsFactor().
inline constexpr int kSamplesPerReplicate = 64;
inline int samplesPerReplicate() { return timesFactor(kSamplesPerReplicate); }

struct Replicates {
  std::vector<Image> pictures;  ///< each is the mean of `samples` samples per pixel
  int samples = 0;
};

/// Replicates rendered by the CPU backend, of `longer` times as many samples as usual.
inline Replicates replicate(const std::shared_ptr<const Volume>& volume, Scene scene, Method method,
                            int longer = 1) {
  scene.method = method;
  Replicates result{{}, longer * samplesPerReplicate()};
  const auto renderer = makeCpuRenderer(volume, 0);
  const std::atomic<bool> never = false;
  for (int r = 0; r < kReplicates; ++r) {
    scene.seed = std::uint32_t(1000 + r);
    renderer->setScene(scene);
    for (int s = 0; s < result.samples; ++s) renderer->renderSample(never);
    result.pictures.push_back(renderer->image());
  }
  return result;
}

/// The same pictures from multi-level quadrature through these resolutions of the ladder, the film's first.
/// Levels have an eighth to a thirty-second as many corrections as there are samples. `omitted`, a level's
/// index, is a defect: that level is left out.
inline Replicates replicateLevels(const std::shared_ptr<const Volume>& volume, Scene scene, Method method,
                                  const std::vector<int>& resolutions,
                                  std::optional<std::size_t> omitted = {}) {
  scene.method = method;
  scene.step = sceneStep(resolutionAt(resolutions[0]));
  Replicates result{{}, samplesPerReplicate()};
  std::vector<Level> levels;
  for (std::size_t k = 1; k < resolutions.size(); ++k)
    levels.push_back({{resolutionAt(resolutions[k]), resolutionAt(resolutions[k - 1]), 1, 0, 0, 0},
                      1,
                      1,
                      std::min(0.125, std::ldexp(0.5, -int(k)))});
  if (omitted) levels.erase(levels.begin() + std::ptrdiff_t(*omitted));
  const auto launcher = makeCpuLauncher(0);
  const std::atomic<bool> never = false;
  std::shared_ptr<const RenderPlan> plan;
  for (int r = 0; r < kReplicates; ++r) {
    scene.seed = std::uint32_t(1000 + r);
    plan = std::make_shared<const RenderPlan>(volume, scene, plan.get());
    Film film;
    film.reset(scene.width, scene.height);
    Corrections corrections;
    corrections.reset(levels);
    constexpr auto kNoDeadline = std::chrono::steady_clock::time_point::max();
    launcher->run([&] {
      for (int s = 0; s < result.samples; ++s) {
        std::vector<std::uint8_t> done(film.pixelCount());
        launcher->launch({.plan = plan.get(),
                          .method = scene.method,
                          .scene = plan->view(),
                          .number = sampleNumber(scene.sampling, film.samples()),
                          .pixels = film.pass(),
                          .done = done.data(),
                          .cancel = &never,
                          .deadline = kNoDeadline});
        const auto addLevel = [&] {
          film.addLevel();
          return true;
        };
        corrections.render(*launcher, *plan, film, addLevel, nullptr, never, kNoDeadline);
        film.add();
        corrections.add(film);
      }
    });
    for (std::size_t l = 0; l < levels.size(); ++l) EXPECT_GT(film.corrections(l), 1u);
    result.pictures.push_back(film.image());
  }
  return result;
}

/// The same pictures from one kernel of the test's choice, on a view to which `change` may have added a
/// defect. `change(view)` is called for every replicate; objects that it makes the view point to must live
/// until the next call.
template <class Integrator, class Blend, class Lighting, class Change>
Replicates replicateKernel(const std::shared_ptr<const Volume>& volume, Scene scene, Change&& change) {
  Replicates result{{}, samplesPerReplicate()};
  std::shared_ptr<const RenderPlan> plan;
  for (int r = 0; r < kReplicates; ++r) {
    scene.seed = std::uint32_t(1000 + r);
    plan = std::make_shared<const RenderPlan>(volume, scene, plan.get());
    kernel::SceneView view = plan->view();
    change(view);
    const std::size_t count = std::size_t(view.width) * std::size_t(view.height);
    std::vector<glm::vec4> pass(count);
    std::vector<glm::dvec4> sum(count, glm::dvec4(0));
    for (int s = 0; s < result.samples; ++s) {
      const kernel::RenderPixel<Integrator, Blend, Lighting> pixel{
          view, sampleNumber(scene.sampling, std::uint32_t(s)), pass.data(), nullptr};
      for (int i = 0; i < int(count); ++i) {
        pixel(i);
        sum[std::size_t(i)] += glm::dvec4(pass[std::size_t(i)]);
      }
    }
    Image picture{view.width, view.height, std::vector<glm::vec4>(count)};
    for (std::size_t i = 0; i < count; ++i) picture.pixels[i] = glm::vec4(sum[i] / double(result.samples));
    result.pictures.push_back(std::move(picture));
  }
  return result;
}

}  // namespace scolopax::test
