// SPDX-License-Identifier: Apache-2.0
// Nothing is fast or accurate alone: every method becomes a list of points (time, error), measured in one
// run, taking turns, against the double-precision reference.
#include "server/commands/bench.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "renderer/core/error.h"
#include "renderer/io/output_file.h"
#include "renderer/metrics/flip.h"
#include "renderer/metrics/metrics.h"
#include "renderer/reference/render.h"
#include "renderer/renderer.h"
#include "server/commands/scene_arguments.h"
#include "server/commands/validators.h"

namespace scolopax {
namespace {

using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr double kTargets[] = {1e-2, 1e-3};  // RMSE

struct Options {
  SceneArguments scene;
  std::vector<std::string> methods;
  std::vector<std::uint32_t> samples{1, 4, 16, 64};
  std::vector<double> steps{4, 2, 1, 0.5};
  int repetitions = 3;
  int threads = 0;
  std::filesystem::path json;
};

/// What one method is measured with, and what came out.
struct Point {
  Method method;
  std::uint32_t samples;
  double step;  ///< of the marcher; 0 for trackers
  std::vector<double> seconds, squaredErrors;
  std::vector<glm::dvec4> sum;  ///< of the pictures of all repetitions
  double flip = 0;
  RenderStats counts;
  std::uint32_t samplesTimed = 0;

  double time() const {
    std::vector<double> sorted = seconds;
    std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(sorted.size() / 2), sorted.end());
    return sorted[sorted.size() / 2];
  }
  double mse() const {
    double all = 0;
    for (const double e : squaredErrors) all += e;
    return all / double(squaredErrors.size());
  }
  double rmse() const { return std::sqrt(mse()); }
  double efficiency() const { return 1 / (mse() * time()); }
};

/// Squared error that stays when pictures of independent seeds are averaged: that of the mean of k pictures
/// is bias^2 + noise / k, of one bias^2 + noise.
double biasOf(const Point& point, const Image& truth) {
  const double k = double(point.seconds.size());
  Image mean{truth.width, truth.height, {}};
  for (const glm::dvec4& v : point.sum) mean.pixels.push_back(glm::vec4(v / k));
  const double ofMean = std::pow(compareImages(mean, truth).rmse, 2);
  return std::sqrt(std::max(0.0, (k * ofMean - point.mse()) / (k - 1)));
}

/// Rising, each number once.
template <class Number>
std::vector<Number> ordered(std::vector<Number> numbers) {
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

std::vector<Point> pointsOf(const Options& options) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < std::size(kMethods); ++i) {
    const auto method = Method(i);
    if (!options.methods.empty() &&
        std::find(options.methods.begin(), options.methods.end(), nameOf(method)) == options.methods.end())
      continue;
    if (method == Method::raymarch)
      for (const double step : ordered(options.steps)) points.push_back({method, 1, step, {}, {}, {}, 0, {}});
    else
      for (const std::uint32_t samples : ordered(options.samples))
        points.push_back({method, samples, 0, {}, {}, {}, 0, {}});
  }
  return points;
}

void measure(Point& point, Renderer& renderer, Scene scene, const Image& truth) {
  // Another picture first: else the film would go on with the samples of the point before.
  scene.method = point.method == Method::raymarch ? Method::superposed : Method::raymarch;
  renderer.setScene(scene);
  scene.method = point.method;
  if (point.step > 0) scene.step = point.step;
  renderer.setScene(scene);
  const std::atomic<bool> cancel = false;
  const auto begin = Clock::now();
  point.samplesTimed = 0;
  for (; renderer.samples() < point.samples; ++point.samplesTimed) renderer.renderSample(cancel);
  point.seconds.push_back(std::chrono::duration<double>(Clock::now() - begin).count());
  const Image image = renderer.image();
  point.squaredErrors.push_back(std::pow(compareImages(image, truth).rmse, 2));
  if (point.seconds.size() == 1) point.flip = flipDifference(image, truth).mean;
  point.sum.resize(image.pixels.size(), glm::dvec4(0));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) point.sum[i] += glm::dvec4(image.pixels[i]);
}

/// Counts, apart from the timings, which counting would slow down.
void count(Point& point, const std::shared_ptr<const Volume>& volume, Scene scene, int threads) {
  const auto renderer = makeCpuRenderer(volume, threads);
  renderer->countCosts();
  scene.method = point.method;
  if (point.step > 0) scene.step = point.step;
  renderer->setScene(scene);
  const std::atomic<bool> cancel = false;
  renderer->renderSample(cancel);
  point.counts = renderer->stats();
}

/// Seconds to an RMSE: of an unbiased method by the law of its noise, of a marcher by its fastest picture
/// that is good enough; null when there is none.
ordered_json timeTo(double target, Method method, const std::vector<Point>& points) {
  const Point* best = nullptr;
  for (const Point& point : points) {
    if (point.method != method) continue;
    if (method != Method::raymarch)
      best = &point;  // the last has the most samples
    else if (point.rmse() <= target && (!best || point.time() < best->time()))
      best = &point;
  }
  if (!best) return nullptr;
  return method == Method::raymarch ? best->time() : best->time() * best->mse() / (target * target);
}

ordered_json report(const std::vector<Point>& points, const Image& truth, const Scene& scene) {
  std::map<std::uint32_t, double> yardstick;  // efficiency of sync-dda by samples
  for (const Point& point : points)
    if (point.method == Method::syncDda) yardstick[point.samples] = point.efficiency();
  ordered_json rows = ordered_json::array();
  for (const Point& point : points) {
    const double rays = double(point.samples) * double(scene.width) * double(scene.height);
    const double counted = double(std::max<std::uint64_t>(point.counts.rays, 1));
    ordered_json row = {{"method", nameOf(point.method)},
                        {"samples", point.samples},
                        {"step", point.step > 0 ? ordered_json(point.step) : ordered_json()},
                        {"seconds", point.time()},
                        {"samplesTimed", point.samplesTimed},
                        {"nsPerRay", 1e9 * point.time() / rays},
                        {"rmse", point.rmse()},
                        {"psnr", -20 * std::log10(point.rmse())},
                        {"flip", point.flip},
                        {"bias", biasOf(point, truth)},
                        {"fetchesPerRay", double(point.counts.fetches) / counted},
                        {"cellStepsPerRay", double(point.counts.cellSteps) / counted},
                        {"randomBlocksPerRay", double(point.counts.randomBlocks) / counted}};
    if (point.method != Method::raymarch && yardstick.contains(point.samples))
      row["efficiencyToSyncDda"] = point.efficiency() / yardstick[point.samples];
    rows.push_back(row);
  }
  ordered_json times = ordered_json::array();
  for (std::size_t i = 0; i < std::size(kMethods); ++i) {
    const auto method = Method(i);
    if (std::none_of(points.begin(), points.end(), [&](const Point& p) { return p.method == method; }))
      continue;
    ordered_json row = {{"method", nameOf(method)}};
    for (const double target : kTargets)
      row[fmt::format("secondsToRmse{:g}", target)] = timeTo(target, method, points);
    times.push_back(row);
  }
  return {{"points", rows}, {"timeToError", times}};
}

void print(const ordered_json& result) {
  fmt::print("{:<11}{:>8}{:>6}{:>11}{:>9}{:>11}{:>8}{:>9}{:>11}{:>9}{:>8}{:>9}{:>10}\n", "method", "samples",
             "step", "seconds", "ns/ray", "RMSE", "PSNR", "FLIP", "bias", "fetches", "cells", "randoms",
             "to sync");
  for (const auto& row : result["points"])
    fmt::print(
        "{:<11}{:>8}{:>6}{:>11.4g}{:>9.0f}{:>11.3e}{:>8.2f}{:>9.4f}{:>11.2e}{:>9.2f}{:>8.2f}{:>9.2f}{:>10}\n",
        row["method"].get<std::string>(), row["samples"].get<std::uint32_t>(),
        row["step"].is_null() ? "" : fmt::format("{:g}", row["step"].get<double>()),
        row["seconds"].get<double>(), row["nsPerRay"].get<double>(), row["rmse"].get<double>(),
        row["psnr"].get<double>(), row["flip"].get<double>(), row["bias"].get<double>(),
        row["fetchesPerRay"].get<double>(), row["cellStepsPerRay"].get<double>(),
        row["randomBlocksPerRay"].get<double>(),
        row.contains("efficiencyToSyncDda") ? fmt::format("x{:.2f}", row["efficiencyToSyncDda"].get<double>())
                                            : "");
}

void bench(const Options& options) {
  for (const std::string& method : options.methods)
    if (std::none_of(std::begin(kMethods), std::end(kMethods),
                     [&](const NamedValue& known) { return known.name == method; }))
      throw CLI::ValidationError("--methods", "there is no method '" + method + "'");
  if (!options.json.empty()) {
    io::checkWritable(options.json);
    checkOutputs({options.json}, options.scene);
  }
  const auto resolved = resolveScene(options.scene);
  const auto volume = resolved->dataset->volume;
  Scene scene = resolved->render;
  scene.filter = PixelFilter::point;  // where the reference has no noise
  fmt::print(stderr, "scolopax: rendering the reference\n");
  const Image truth = reference::renderReference(*volume, scene, 1).image;

  std::vector<Point> points = pointsOf(options);
  const auto renderer = makeCpuRenderer(volume, options.threads);
  for (Point& point : points) count(point, volume, scene, options.threads);  // and warms up
  for (int repetition = 0; repetition < options.repetitions; ++repetition)
    for (Point& point : points) {
      scene.seed = resolved->render.seed + std::uint32_t(repetition);
      measure(point, *renderer, scene, truth);
    }
  ordered_json result = report(points, truth, scene);
  result["scene"] = ordered_json::parse(resolved->resolved.dump());
  result["repetitions"] = options.repetitions;
  result["threads"] = options.threads;
  if (options.json.empty())
    print(result);
  else
    io::writeFile(options.json, result.dump(1) + '\n');
}

}  // namespace

CLI::App* addBenchCommand(CLI::App& root) {
  CLI::App* command =
      root.add_subcommand("bench", "Measure speed against error of the methods on one scene, in one run");
  const auto o = std::make_shared<Options>();
  addSceneArguments(*command, o->scene);
  command->add_option("--methods", o->methods, "Methods to measure; all without this")->delimiter(',');
  command->add_option("--samples", o->samples, "Sample counts of the trackers")
      ->delimiter(',')
      ->check(CLI::Range(1u, 1u << 24));
  command->add_option("--steps", o->steps, "Steps of the marcher, in voxels")
      ->delimiter(',')
      ->check(CLI::Range(0.01, 100.0) & numberUpTo(100, false));
  command->add_option("--repetitions", o->repetitions, "Seeds and timings of every point; medians are told")
      ->check(CLI::Range(2, 1000));
  command->add_option("--threads", o->threads, "Threads to use; 0 takes all")->check(CLI::Range(0, 1024));
  command->add_option("--json", o->json, "Write the numbers here instead of printing a table");
  command->footer(
      "Samples go through the pixels' centres, where the reference has no noise. Unbiased methods are "
      "compared\n"
      "by 1 / (MSE x seconds) with sync-dda at the same number of samples (to sync); the bias of a marcher "
      "is\n"
      "what stays when the pictures of all repetitions are averaged.");
  command->callback([o] { bench(*o); });
  return command;
}

}  // namespace scolopax
