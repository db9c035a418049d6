// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/step_bias.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>

#include "renderer/core/error.h"
#include "renderer/data/camera.h"
#include "renderer/data/sampling.h"

namespace scolopax {
namespace {

constexpr double kSteps[] = {4, 2, 1, 0.5, 0.25, 0.125};

/// Independent samples at one step. Sample s has the same random numbers at every step, and so nearly the
/// same noise.
struct Pictures {
  double step;  ///< smallest spacings
  std::vector<std::vector<glm::vec4>> samples;
};
/// Number of samples taken first, and at most. Where one step has noise that another has not, more samples
/// distinguish the noise from bias.
constexpr std::size_t kSamples = 4, kMostSamples = 32;
/// Maximum number of segments of a ray, at the smallest step.
constexpr double kMostSegments = 1 << 16;

class Thumbnails {
 public:
  Thumbnails(Launcher& launcher, const RenderPlan& plan, const Scene& scene, const std::stop_token& stop)
      : launcher_(launcher), scene_(scene), view_(plan.view()), onStop_(stop, RaiseFlag{&stopped_}) {
    const bool lit = scene.shading || (scene.shadows && view_.lightCount > 0);
    const double longer = std::max(scene.width, scene.height);
    const double scale = (lit ? kLitThumbnailSide : kThumbnailSide) / longer;
    view_.width = std::max(1, int(std::lround(scene.width * scale)));
    view_.height = std::max(1, int(std::lround(scene.height * scale)));
    view_.rays = makeCameraRays(scene.camera, plan.grid(), view_.width, view_.height);
    view_.filterBox = false;  // the rays of all steps go through the same points
    view_.seed = 0;
    view_.stratum = stratumOf(scene.method);
  }

  Pictures render(double step) {
    Pictures pictures{step, {}};
    addSamples(pictures, kSamples);
    return pictures;
  }
  /// Adds samples until there are `count`. Throws Error(cancelled) once a stop is requested.
  void addSamples(Pictures& pictures, std::size_t count) {
    view_.step = view_.smallestSpacing * float(pictures.step);
    const std::size_t pixels = std::size_t(view_.width) * std::size_t(view_.height);
    while (pictures.samples.size() < count) {
      const auto number = sampleNumber(Sampling::independent, std::uint32_t(pictures.samples.size()));
      std::vector<glm::vec4>& sample = pictures.samples.emplace_back(pixels);
      std::vector<std::uint8_t> done(pixels, 0);
      const Pass pass{view_,   number,      sample.data(), nullptr,
                      nullptr, done.data(), &stopped_,     std::chrono::steady_clock::time_point::max()};
      if (!launcher_.launch(scene_, pass))
        throw Error(ErrorCode::cancelled, "the bias estimate was cancelled");
      rays_ += pixels;
    }
  }
  std::uint64_t rays() const { return rays_; }

 private:
  struct RaiseFlag {
    std::atomic<bool>* flag;
    void operator()() const { *flag = true; }
  };
  Launcher& launcher_;
  const Scene scene_;
  kernel::SceneView view_;
  std::uint64_t rays_ = 0;
  std::atomic<bool> stopped_{false};
  std::stop_callback<RaiseFlag> onStop_;
};

/// An estimate, and its standard deviation from the spread of the pixels.
struct Estimate {
  double value, deviation;
  double upper() const { return std::max(0.0, value) + kDeviations * deviation; }
};

/// Mean squared difference of the expected pictures of two steps. Computed from products of different
/// samples, in which noise cancels out.
Estimate squaredDifference(const Pictures& a, const Pictures& b) {
  const std::size_t count = std::min(a.samples.size(), b.samples.size()), pixels = a.samples[0].size();
  const double n = double(count);
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    glm::dvec4 all(0);
    double own = 0;
    for (std::size_t s = 0; s < count; ++s) {
      const glm::dvec4 difference = glm::dvec4(a.samples[s][i]) - glm::dvec4(b.samples[s][i]);
      all += difference;
      own += glm::dot(difference, difference);
    }
    const double product = (glm::dot(all, all) - own) / (n * (n - 1)) / 4;
    sum += product;
    squares += product * product;
  }
  const double mean = sum / double(pixels), variance = std::max(0.0, squares / double(pixels) - mean * mean);
  return {mean, std::sqrt(variance / double(pixels))};
}

/// Thumbnails at all steps that have been requested.
class Steps {
 public:
  Steps(Launcher& launcher, const RenderPlan& plan, const Scene& scene, const std::stop_token& stop)
      : thumbnails_(launcher, plan, scene, stop),
        finest_(plan.grid().diagonal() / double(plan.view().smallestSpacing) / kMostSegments) {}

  /// Whether the fine step that `step` is compared with is large enough to be rendered.
  bool canTell(double step) const { return step / 4 >= finest_; }

  /// RMS difference of the expected picture at `step` from that at an infinitely fine step. The sum of two
  /// terms: the difference from a fine step, and that of finer steps, if every further halving of the step
  /// reduces the differences by the same ratio. The fine step is short enough not to leap over voxels: steps
  /// that all leap over the same voxels give similar pictures.
  double bias(double step) {
    step = std::max(step, finest_);
    const double finest = fineStep(step);
    const Pictures& fine = at(finest);
    const Estimate last = squaredDifference(at(2 * finest), fine);
    const Estimate before = squaredDifference(at(4 * finest), at(2 * finest));
    // 4 where the error is of second order, as that of quadrature is for smooth fields.
    double ratio = 4;
    if (last.value > last.deviation)
      ratio = std::clamp(std::sqrt(std::max(0.0, before.value) / last.value), 1.5, 4.0);
    return std::sqrt(squaredDifference(at(step), fine).upper()) + std::sqrt(last.upper()) / (ratio - 1);
  }
  /// A lower estimate: the difference from the fine step only, with neither extrapolation nor deviations
  /// added.
  double leastBias(double step) {
    return std::sqrt(std::max(0.0, squaredDifference(at(step), at(fineStep(step))).value));
  }
  /// Doubles the number of samples by which `step` is judged. Returns false if that exceeds the limit.
  bool lookAgain(double step) {
    const std::size_t more = 2 * at(step).samples.size();
    if (more > kMostSamples) return false;
    const double finest = fineStep(step);
    for (const double s : {step, 4 * finest, 2 * finest, finest}) thumbnails_.addSamples(at(s), more);
    return true;
  }
  std::uint64_t rays() const { return thumbnails_.rays(); }

 private:
  double fineStep(double step) const { return std::max(std::min(step / 4, 0.25), finest_); }
  Pictures& at(double step) {
    const auto found = pictures_.find(step);
    return found != pictures_.end() ? found->second
                                    : pictures_.emplace(step, thumbnails_.render(step)).first->second;
  }

  Thumbnails thumbnails_;
  double finest_;  // smallest spacings
  std::map<double, Pictures> pictures_;
};

}  // namespace

double estimateBias(Launcher& launcher, const RenderPlan& plan, const std::stop_token& stop) {
  return Steps(launcher, plan, plan.scene(), stop).bias(plan.scene().step);
}

std::optional<BiasedStep> largestStep(Launcher& launcher, const RenderPlan& plan, Method method,
                                      double target, const std::stop_token& stop, std::uint64_t* rays) {
  Scene scene = plan.scene();
  scene.method = method;
  Steps steps(launcher, plan, scene, stop);
  std::optional<BiasedStep> found;
  for (const double step : kSteps) {
    if (!steps.canTell(step)) break;
    double bias = steps.bias(step);
    while (bias > target && steps.leastBias(step) <= target && steps.lookAgain(step)) bias = steps.bias(step);
    if (bias > target) continue;
    found = BiasedStep{step, bias};
    break;
  }
  if (rays) *rays = steps.rays();
  return found;
}

}  // namespace scolopax
