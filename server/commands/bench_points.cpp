// SPDX-License-Identifier: Apache-2.0
#include "server/commands/bench_points.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "renderer/metrics/metrics.h"

namespace scolopax::bench {
namespace {

using nlohmann::ordered_json;

constexpr double kTargets[] = {1e-2, 1e-3};  // RMSE

/// Whether an error remains after any number of samples. `auto` may choose a biased method.
bool isBiased(Method method) { return hasStep(method) || method == Method::automatic; }

struct Reached {
  double seconds, samples, step;
};

/// The fastest way to the target among one method's points, if any reaches it.
std::optional<Reached> reach(double target, const std::vector<const Point*>& points,
                             const std::optional<Image>& truth) {
  std::optional<Reached> best;
  const double wanted = target * target;
  for (const Point* point : points) {
    double samples = point->samples;
    if (!isBiased(point->method)) {
      samples = std::max(1.0, samples * point->mse() / wanted);
      best.reset();  // the last point has the most samples
    } else {
      const double bias = squaredBias(*point, *truth);
      if (bias < 0.5 * wanted)
        samples = std::max(1.0, std::ceil(samples * std::max(0.0, point->mse() - bias) / (wanted - bias)));
      else if (point->mse() > wanted)
        continue;
      if (samples > kMaxReach * point->samples) continue;
    }
    const double seconds = point->time() * samples / point->samples;
    if (!best || seconds < best->seconds) best = {seconds, samples, point->step};
  }
  return best;
}

ordered_json rowOf(const Point& point, const std::optional<Image>& truth, std::size_t pixels) {
  const double rays = double(point.samples) * double(pixels);
  const double counted = double(std::max<std::uint64_t>(point.counts.rays, 1));
  ordered_json row = {{"method", nameOf(point.method)},
                      {"samples", point.samples},
                      {"step", hasStep(point.method) ? ordered_json(point.step) : ordered_json()},
                      {"macrocell", point.macrocell},
                      {"threads", point.threads},
                      {"seconds", point.time()},
                      {"samplesTimed", point.samplesTimed},
                      {"nsPerRay", 1e9 * point.time() / rays},
                      {"rebuildMs", point.rebuildMs},
                      {"fetchesPerRay", double(point.counts.fetches) / counted},
                      {"cellStepsPerRay", double(point.counts.cellSteps) / counted},
                      {"randomBlocksPerRay", double(point.counts.randomBlocks) / counted}};
  if (!truth) return row;
  row["rmse"] = std::sqrt(point.mse());
  row["psnr"] = -10 * std::log10(point.mse());
  row["flip"] = point.flip;
  row["bias"] = std::sqrt(squaredBias(point, *truth));
  return row;
}

}  // namespace

double Point::time() const {
  std::vector<double> sorted = seconds;
  std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(sorted.size() / 2), sorted.end());
  return sorted[sorted.size() / 2];
}

double Point::mse() const {
  double all = 0;
  for (const double e : squaredErrors) all += e;
  return all / double(squaredErrors.size());
}

double squaredBias(const Point& point, const Image& truth) {
  const double k = double(point.seconds.size());
  Image mean{truth.width, truth.height, {}};
  for (const glm::dvec4& v : point.sum) mean.pixels.push_back(glm::vec4(v / k));
  const double ofMean = std::pow(compareImages(mean, truth).rmse, 2);
  return std::max(0.0, (k * ofMean - point.mse()) / (k - 1));
}

ordered_json report(const std::vector<Point>& points, const std::optional<Image>& truth, std::size_t pixels) {
  using Conditions = std::tuple<std::uint32_t, int, int>;
  const auto conditions = [](const Point& p) { return Conditions(p.samples, p.macrocell, p.threads); };
  std::map<Conditions, const Point*> yardstick;
  for (const Point& point : points)
    if (point.method == Method::syncDda) yardstick[conditions(point)] = &point;
  ordered_json rows = ordered_json::array(), times = ordered_json::array();
  std::map<std::tuple<Method, int, int>, std::vector<const Point*>> groups;
  for (const Point& point : points) {
    rows.push_back(rowOf(point, truth, pixels));
    if (!truth) continue;
    const auto sync = yardstick.find(conditions(point));
    if (!isBiased(point.method) && sync != yardstick.end())
      rows.back()["efficiencyToSyncDda"] = point.efficiency() / sync->second->efficiency();
    groups[{point.method, point.macrocell, point.threads}].push_back(&point);
  }
  for (const auto& [key, group] : groups) {
    ordered_json row = {
        {"method", nameOf(std::get<0>(key))}, {"macrocell", std::get<1>(key)}, {"threads", std::get<2>(key)}};
    for (const double target : kTargets) {
      const auto found = reach(target, group, truth);
      const auto value = [&](double number) { return found ? ordered_json(number) : ordered_json(); };
      row[fmt::format("secondsToRmse{:g}", target)] = value(found ? found->seconds : 0);
      row[fmt::format("samplesToRmse{:g}", target)] = value(found ? found->samples : 0);
      row[fmt::format("stepToRmse{:g}", target)] = value(found ? found->step : 0);
    }
    times.push_back(row);
  }
  return {{"points", rows}, {"timeToError", times}};
}

void print(const ordered_json& result) {
  fmt::print("{:<11}{:>8}{:>6}{:>5}{:>4}{:>11}{:>9}{:>9}{:>8}{:>9}{:>11}{:>8}{:>9}{:>11}{:>9}\n", "method",
             "samples", "step", "cell", "thr", "seconds", "ns/ray", "fetches", "cells", "randoms", "RMSE",
             "PSNR", "FLIP", "bias", "to sync");
  for (const auto& row : result["points"]) {
    const auto number = [&](const char* name) { return row[name].get<double>(); };
    fmt::print("{:<11}{:>8}{:>6}{:>5}{:>4}{:>11.4g}{:>9.0f}{:>9.2f}{:>8.2f}{:>9.2f}",
               row["method"].get<std::string>(), row["samples"].get<std::uint32_t>(),
               row["step"].is_null() ? "" : fmt::format("{:g}", number("step")), row["macrocell"].get<int>(),
               row["threads"].get<int>(), number("seconds"), number("nsPerRay"), number("fetchesPerRay"),
               number("cellStepsPerRay"), number("randomBlocksPerRay"));
    if (row.contains("rmse"))
      fmt::print("{:>11.3e}{:>8.2f}{:>9.4f}{:>11.2e}", number("rmse"), number("psnr"), number("flip"),
                 number("bias"));
    if (row.contains("efficiencyToSyncDda"))
      fmt::print("{:>9}", fmt::format("x{:.2f}", number("efficiencyToSyncDda")));
    fmt::print("\n");
  }
}

}  // namespace scolopax::bench
