// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/random_scenes/estimates.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "renderer/renderer.h"

namespace scolopax::random_scenes {
namespace {

/// Sums of values relative to a first guess, which keeps the variance accurate when the spread is small.
class Sums {
 public:
  explicit Sums(std::size_t pixels)
      : guess_(pixels + 1),
        sum_(pixels + 1, glm::dvec4(0)),
        squares_(sum_),
        least_(pixels + 1, glm::dvec4(std::numeric_limits<double>::infinity())),
        most_(pixels + 1, glm::dvec4(-std::numeric_limits<double>::infinity())) {}

  void add(std::vector<glm::dvec4> values) {
    glm::dvec4 whole(0);
    for (const glm::dvec4& value : values) whole += value;
    values.push_back(whole / double(values.size()));
    if (count_ == 0) guess_ = values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const glm::dvec4 d = values[i] - guess_[i];
      sum_[i] += d;
      squares_[i] += d * d;
      least_[i] = glm::min(least_[i], values[i]);
      most_[i] = glm::max(most_[i], values[i]);
    }
    ++count_;
  }

  Estimates estimates() const {
    Estimates result{count_, {}, {}, least_, most_};
    for (std::size_t i = 0; i < sum_.size(); ++i) {
      const glm::dvec4 mean = sum_[i] / count_;
      result.mean.push_back(guess_[i] + mean);
      result.variance.push_back(glm::max(glm::dvec4(0), squares_[i] / count_ - mean * mean) * count_ /
                                std::max(1.0, count_ - 1));
    }
    return result;
  }

 private:
  double count_ = 0;
  std::vector<glm::dvec4> guess_, sum_, squares_, least_, most_;
};

const std::atomic<bool> kNever = false;

}  // namespace

Estimates estimate(const std::shared_ptr<const Volume>& volume, const Scene& asked, Effort effort,
                   std::uint32_t round) {
  Scene scene = asked;
  const auto renderer = makeCpuRenderer(volume, 1);
  const std::size_t pixels = std::size_t(scene.width) * std::size_t(scene.height);
  Sums sums(pixels);
  std::vector<glm::dvec4> values(pixels);
  for (int r = 0; r < effort.seeds; ++r) {
    scene.seed = asked.seed + round * 0x10001u + std::uint32_t(r);
    renderer->setScene(scene);
    std::vector<glm::dvec4> before(pixels, glm::dvec4(0));
    for (int s = 1; s <= effort.samples; ++s) {
      renderer->renderSample(kNever);
      const bool last = s == effort.samples;
      if (scene.sampling != Sampling::independent && !last) continue;
      const Image image = renderer->image();
      for (std::size_t i = 0; i < pixels; ++i) {
        const glm::dvec4 sum = double(s) * glm::dvec4(image.pixels[i]);
        values[i] = scene.sampling == Sampling::independent ? sum - before[i] : glm::dvec4(image.pixels[i]);
        before[i] = sum;
      }
      sums.add(values);
    }
  }
  return sums.estimates();
}

double costOf(const std::shared_ptr<const Volume>& volume, const Scene& scene) {
  const auto renderer = makeCpuRenderer(volume, 1);
  renderer->countCosts();
  renderer->setScene(scene);
  constexpr int kSamples = 4;
  for (int i = 0; i < kSamples; ++i) renderer->renderSample(kNever);
  const RenderStats stats = renderer->stats();
  return 100 + double(stats.fetches + stats.cellSteps + stats.randomBlocks + 5 * stats.rays) / kSamples;
}

double empiricalBernstein(double variance, double range, double count, double logTerm) {
  return std::sqrt(2 * variance * logTerm / count) + 7 * range * logTerm / (3 * std::max(1.0, count - 1));
}

double largestSample(const Scene& scene) {
  glm::dvec3 light(0);
  for (const Light& l : scene.lights) light += l.color * l.intensity;
  if (scene.lights.empty()) light = glm::dvec3(1);
  double largest = 1, sum = 0;
  for (const ChannelAppearance& a : scene.channels) {
    if (!a.visible) continue;
    glm::dvec3 color(0);
    for (const ColorKnot& knot : a.color) color = glm::max(color, knot.color);
    for (const Isovalue& isovalue : a.isovalues) color = glm::max(color, isovalue.color.value_or(color));
    const Material& m = a.material;
    glm::dvec3 shown = color;
    if (scene.shadows) shown = color * std::max(1.0, m.ambient);
    if (scene.shading) shown = glm::max(shown, color * (m.ambient + m.diffuse * light)) + m.specular * light;
    // Surfaces are not weighted.
    if (scene.blend == BlendMode::mix)
      shown *= a.isovalues.empty() && a.peaks == Peaks::off ? a.weight : std::max(1.0, a.weight);
    const double most = std::max({shown.x, shown.y, shown.z});
    largest = std::max(largest, most);
    sum += most;
  }
  const bool several = scene.blend == BlendMode::mix || scene.blend == BlendMode::composite;
  return several ? std::max(1.0, sum) : largest;
}

}  // namespace scolopax::random_scenes
