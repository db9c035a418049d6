// SPDX-License-Identifier: Apache-2.0
// Independent pictures of one scene: each has its own seed, which scrambles the low-discrepancy points
// differently. Their spread shows how large the noise is; agreement.h compares them.
#pragma once
#include <utility>
#include <vector>

#include "renderer/data/render_plan.h"
#include "renderer/data/sampling.h"
#include "renderer/kernel/analog.h"
#include "renderer/kernel/render_pixel.h"
#include "tests/support/statistics.h"

namespace scolopax::test {

inline constexpr int kReplicates = 32;
/// Samples of a replicate, times statisticsFactor(): all points of one scrambling.
inline constexpr int kSamplesPerReplicate = int(kernel::kReplicateSamples);
inline int samplesPerReplicate() { return kSamplesPerReplicate * statisticsFactor(); }

struct Replicates {
  std::vector<Image> pictures;  ///< each is the mean of `samples` samples per pixel
  int samples = 0;
};

/// Replicates rendered by the CPU backend.
inline Replicates replicate(const std::shared_ptr<const Volume>& volume, Scene scene, Method method) {
  scene.method = method;
  Replicates result{{}, samplesPerReplicate()};
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

/// The same pictures from one kernel of the test's choice, on a view to which `change` may have added a
/// defect. `change(view)` is called for every replicate; objects that it makes the view point to must live
/// until the next call.
template <class Integrator, class Blend, class Features, class Change>
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
      const kernel::RenderPixel<Integrator, Blend, Features> pixel{
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
