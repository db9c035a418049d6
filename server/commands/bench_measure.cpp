// SPDX-License-Identifier: Apache-2.0
#include "server/commands/bench_measure.h"

#include <fmt/core.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "renderer/metrics/flip.h"
#include "renderer/metrics/metrics.h"
#include "server/stop_rule.h"

namespace scolopax::bench {
namespace {

using Clock = std::chrono::steady_clock;

const std::atomic<bool> kNeverCancel = false;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// The pixels whose centres are also pixel centres of a picture `factor` (odd) times smaller.
Image thinned(const Image& image, int factor) {
  Image small{image.width / factor, image.height / factor, {}};
  for (int y = factor / 2; y < image.height; y += factor)
    for (int x = factor / 2; x < image.width; x += factor)
      small.pixels.push_back(image.pixels[std::size_t(y) * std::size_t(image.width) + std::size_t(x)]);
  return small;
}

class Measuring {
 public:
  Measuring(const Measurement& wanted, const Renderers& renderers, const Renderers& counting, Scene scene,
            const std::optional<Image>& truth)
      : wanted_(wanted),
        renderers_(renderers),
        counting_(counting),
        scene_(std::move(scene)),
        truth_(truth) {}

  std::vector<Point> run() {
    // One list of points for each setting.
    std::vector<std::vector<Point>> next, all(wanted_.settings.size());
    for (const Setting& setting : wanted_.settings) next.push_back(firstPoints(setting));
    if (leftOut_ > 0)
      fmt::print(stderr, "scolopax: skipped {} points that would take longer than {:g} s\n", leftOut_,
                 wanted_.longest);
    for (bool any = true; any;) {
      measureInTurns(next);
      any = false;
      for (std::size_t i = 0; i < next.size(); ++i) {
        all[i].insert(all[i].end(), next[i].begin(), next[i].end());
        next[i].clear();
        if (!mayGrow(all[i].back())) continue;
        next[i].push_back(doubled(all[i].back()));
        any = true;
      }
    }
    std::vector<Point> points;
    for (std::vector<Point>& some : all) std::move(some.begin(), some.end(), std::back_inserter(points));
    return points;
  }

 private:
  Scene sceneOf(const Setting& setting) const {
    Scene scene = scene_;
    scene.method = setting.method;
    scene.macrocell = setting.macrocell;
    if (hasStep(setting.method)) scene.step = setting.step;
    return scene;
  }

  double longestOf(const Point& point) const {
    return point.method == Method::automatic && !hasNoiseLaw(point) ? wanted_.automaticLongest
                                                                    : wanted_.longest;
  }

  /// The numbers of samples that stay within the longest time, as predicted by one sample, which also warms
  /// up the renderer. The smallest number is always kept.
  std::vector<Point> firstPoints(const Setting& setting) {
    Point point(setting);
    Renderer& renderer = *renderers_.at(setting.threads);
    point.rebuildMs = renderer.setScene(sceneOf(setting)).rebuildMs;
    point.choice = renderer.choice();
    const auto begin = Clock::now();
    renderer.renderSample(kNeverCancel);
    const double one = secondsSince(begin);
    std::vector<Point> points;
    for (const std::uint32_t count : wanted_.samples) {
      if (count > wanted_.samples.front() && count * one > longestOf(point)) {
        ++leftOut_;
        continue;
      }
      point.samples = count;
      points.push_back(point);
    }
    this->count(points);
    return points;
  }

  /// Counts what samples cost: the first one, and of Method::automatic all, because it has corrections later.
  void count(std::vector<Point>& points) const {
    Renderer& renderer = *counting_.at(points[0].threads);
    renderer.setScene(sceneOf(points[0]));
    for (Point& point : points) {
      const std::uint32_t samples = point.method == Method::automatic ? point.samples : 1;
      while (renderer.samples() < samples) renderer.renderSample(kNeverCancel);
      point.counts = renderer.stats();
      point.samplesCounted = samples;
    }
  }

  void measureInTurns(std::vector<std::vector<Point>>& settings) {
    for (int repetition = 0; repetition < wanted_.repetitions; ++repetition)
      for (std::vector<Point>& points : settings)
        for (Point& point : points) {
          if (repetition >= 2 && point.seconds.front() > kLongPicture) continue;
          // Every picture has its own seed, so that no picture continues the samples of the previous one.
          ++scene_.seed;
          measurePicture(point);
        }
  }

  void measurePicture(Point& point) const {
    Renderer& renderer = *renderers_.at(point.threads);
    auto begin = Clock::now();
    renderer.setScene(sceneOf(point));
    point.setSceneSeconds.push_back(secondsSince(begin));
    begin = Clock::now();
    point.samplesTimed = 0;
    for (; renderer.samples() < point.samples; ++point.samplesTimed) renderer.renderSample(kNeverCancel);
    point.seconds.push_back(secondsSince(begin));
    point.choice = renderer.choice();
    if (!truth_) return;
    const Image image = thinned(renderer.image(), scene_.width / truth_->width);
    point.squaredErrors.push_back(std::pow(compareImages(image, *truth_).rmse, 2));
    if (point.samples > 1 && !isBiased(point) && !renderer.errorTakesLong())
      point.estimates.push_back(renderer.estimatedError());
    if (point.seconds.size() == 1) point.flip = flipDifference(image, *truth_).mean;
    point.sum.resize(image.pixels.size(), glm::dvec4(0));
    for (std::size_t i = 0; i < image.pixels.size(); ++i) point.sum[i] += glm::dvec4(image.pixels[i]);
  }

  bool mayGrow(const Point& point) const {
    if (!wanted_.until || point.samples > server::kMaxSamples / 2) return false;
    if (2 * point.time() > longestOf(point)) return false;
    const double wanted = *wanted_.until * *wanted_.until;
    // Below half of the error, what is left is mostly the bias of the step.
    return point.mse() > wanted && !(isBiased(point) && squaredBias(point, *truth_) > 0.5 * point.mse());
  }

  /// The next point of a setting, not measured yet.
  static Point doubled(const Point& point) {
    Point next{static_cast<const Setting&>(point)};
    next.samples *= 2;
    next.counts = point.counts;
    next.samplesCounted = point.samplesCounted;
    next.rebuildMs = point.rebuildMs;
    return next;
  }

  const Measurement& wanted_;
  const Renderers &renderers_, &counting_;
  Scene scene_;
  const std::optional<Image>& truth_;
  int leftOut_ = 0;
};

}  // namespace

std::vector<Point> measure(const Measurement& wanted, const Renderers& renderers, const Renderers& counting,
                           Scene scene, const std::optional<Image>& truth) {
  return Measuring(wanted, renderers, counting, std::move(scene), truth).run();
}

}  // namespace scolopax::bench
