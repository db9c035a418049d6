// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/thumbnails.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "renderer/core/error.h"
#include "renderer/data/camera.h"
#include "renderer/data/instances.h"
#include "renderer/data/sampling.h"
#include "renderer/data/scene_view.h"

namespace scolopax {
namespace {

/// Mean over pixels and components of the variance over n samples value(sample, pixel).
template <class Value>
double meanVariance(std::size_t n, std::size_t pixels, const Value& value) {
  double sum = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    glm::dvec4 all(0);
    double squares = 0;
    for (std::size_t s = 0; s < n; ++s) {
      const glm::dvec4 v = value(s, i);
      all += v;
      squares += glm::dot(v, v);
    }
    sum += std::max(0.0, squares - glm::dot(all, all) / double(n)) / double(n - 1);
  }
  return sum / (4.0 * double(pixels));
}

}  // namespace

Thumbnails::Thumbnails(Launcher& launcher, const RenderPlan& plan, Method method, bool spread,
                       const std::stop_token& stop)
    : launcher_(launcher),
      plan_(plan),
      method_(method),
      view_(plan.view()),
      onStop_(stop, RaiseFlag{&stopped_}) {
  const Scene& scene = plan.scene();
  const bool lit = instanceOf(method, scene.blend, view_).lit;
  const double longer = std::max(scene.width, scene.height);
  const double scale = (lit ? kLitThumbnailSide : kThumbnailSide) / longer;
  view_.width = std::max(1, int(std::lround(scene.width * scale)));
  view_.height = std::max(1, int(std::lround(scene.height * scale)));
  view_.rays = makeCameraRays(scene.camera, plan.grid(), view_.width, view_.height);
  view_.filterWidth *= spread ? float(scale) : 0.0f;
  view_.seed = 0;
  view_.stratum = stratumOf(method);
}

Pictures Thumbnails::render(const Resolution& resolution, std::size_t count) {
  setResolution(view_, resolution);
  const std::size_t pixels = std::size_t(view_.width) * std::size_t(view_.height);
  std::vector<kernel::SampleCost> cost(pixels);
  Pictures pictures{resolution, 0, {}};
  while (pictures.samples.size() < count) {
    const auto number = sampleNumber(Sampling::independent, std::uint32_t(pictures.samples.size()));
    std::vector<glm::vec4>& sample = pictures.samples.emplace_back(pixels);
    std::vector<std::uint8_t> done(pixels, 0);
    const Pass pass{
        &plan_,      method_, view_,       number,    sample.data(),
        cost.data(), nullptr, done.data(), &stopped_, std::chrono::steady_clock::time_point::max()};
    if (!launcher_.launch(pass)) throw Error(ErrorCode::cancelled, "the bias estimate was cancelled");
    rays_ += pixels;
  }
  for (const kernel::SampleCost& ray : cost) pictures.fetches += double(ray.fetches);
  pictures.fetches /= double(count * pixels);
  return pictures;
}

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

double variance(const Pictures& pictures) {
  return meanVariance(pictures.samples.size(), pictures.samples[0].size(),
                      [&](std::size_t s, std::size_t i) { return glm::dvec4(pictures.samples[s][i]); });
}

double varianceOfDifference(const Pictures& a, const Pictures& b) {
  return meanVariance(std::min(a.samples.size(), b.samples.size()), a.samples[0].size(),
                      [&](std::size_t s, std::size_t i) {
                        return glm::dvec4(a.samples[s][i]) - glm::dvec4(b.samples[s][i]);
                      });
}

}  // namespace scolopax
