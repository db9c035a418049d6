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

Reached reachedWith(const Point& point, double samples) {
  return {point.setSceneTime() + point.time() * samples / point.samples, samples, point.step};
}

/// The samples that a biased point needs, if it shows them.
std::optional<double> samplesAboveBias(double wanted, const Point& point, const Image& truth) {
  const double bias = squaredBias(point, truth);
  double samples = point.samples;
  if (bias < 0.5 * wanted)
    samples = std::max(1.0, std::ceil(samples * std::max(0.0, point.mse() - bias) / (wanted - bias)));
  else if (point.mse() > wanted)
    return std::nullopt;
  if (samples > kMaxReach * point.samples) return std::nullopt;
  return samples;
}

std::optional<Reached> interpolated(double wanted, std::span<const Point* const> points) {
  const Point* before = nullptr;
  for (const Point* point : points) {
    if (point->mse() > wanted) {
      before = point;
      continue;
    }
    if (!before) return reachedWith(*point, point->samples);
    const double w =
        point->mse() > 0 ? std::log(before->mse() / wanted) / std::log(before->mse() / point->mse()) : 1;
    const auto between = [&](double a, double b) { return a * std::pow(b / a, w); };
    return Reached{point->setSceneTime() + between(before->time(), point->time()),
                   between(before->samples, point->samples), 0};
  }
  return std::nullopt;
}

ordered_json choiceOf(const Point& point) {
  ordered_json corrections = ordered_json::array();
  for (const Choice::Correction& level : point.choice.corrections)
    corrections.push_back({{"step", level.step}, {"passes", level.passes}});
  return {{"method", nameOf(point.choice.method)},
          {"step", hasStep(point.choice.method) ? ordered_json(point.choice.step) : ordered_json()},
          {"corrections", corrections}};
}

/// What the renderer says of its error, and by how many times that differs from the true one: medians.
void addEstimates(ordered_json& row, const Point& point) {
  if (point.estimates.empty()) return;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < point.estimates.size(); ++i)
    ratios.push_back(point.estimates[i] / std::sqrt(point.squaredErrors[i]));
  row["estimatedError"] = median(point.estimates);
  row["estimateToError"] = median(ratios);
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
                      {"setSceneSeconds", point.setSceneTime()},
                      {"samplesTimed", point.samplesTimed},
                      {"nsPerRay", 1e9 * point.time() / rays},
                      {"rebuildMs", point.rebuildMs},
                      {"samplesCounted", point.samplesCounted},
                      {"fetchesPerRay", double(point.counts.fetches) / counted},
                      {"cellStepsPerRay", double(point.counts.cellSteps) / counted},
                      {"randomBlocksPerRay", double(point.counts.randomBlocks) / counted},
                      {"truncatedRays", point.counts.truncatedRays}};
  if (point.method == Method::automatic) row["choice"] = choiceOf(point);
  if (!truth) return row;
  row["rmse"] = std::sqrt(point.mse());
  row["psnr"] = -10 * std::log10(point.mse());
  row["flip"] = point.flip;
  row["bias"] = std::sqrt(squaredBias(point, *truth));
  addEstimates(row, point);
  return row;
}

}  // namespace

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

double Point::time() const { return median(seconds); }
double Point::setSceneTime() const { return median(setSceneSeconds); }

double Point::mse() const {
  double all = 0;
  for (const double e : squaredErrors) all += e;
  return all / double(squaredErrors.size());
}

bool hasNoiseLaw(const Point& point) {
  return !hasStep(point.method) && !(point.method == Method::automatic && hasStep(point.choice.method));
}

double squaredBias(const Point& point, const Image& truth) {
  const double k = double(point.seconds.size());
  Image mean{truth.width, truth.height, {}};
  for (const glm::dvec4& v : point.sum) mean.pixels.push_back(glm::vec4(v / k));
  const double ofMean = std::pow(compareImages(mean, truth).rmse, 2);
  return std::max(0.0, (k * ofMean - point.mse()) / (k - 1));
}

std::optional<Reached> reach(double rmse, std::span<const Point* const> points,
                             const std::optional<Image>& truth) {
  const double wanted = rmse * rmse;
  const Point& last = *points.back();
  if (hasNoiseLaw(last)) return reachedWith(last, std::max(1.0, last.samples * last.mse() / wanted));
  if (!isBiased(last)) return interpolated(wanted, points);
  std::optional<Reached> best;
  for (const Point* point : points) {
    const auto samples = samplesAboveBias(wanted, *point, *truth);
    if (!samples) continue;
    const Reached found = reachedWith(*point, *samples);
    if (!best || found.seconds < best->seconds) best = found;
  }
  return best;
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
    if (hasNoiseLaw(point) && sync != yardstick.end())
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
  fmt::print("{:<11}{:>8}{:>6}{:>5}{:>4}{:>11}{:>10}{:>9}{:>9}{:>8}{:>9}{:>11}{:>8}{:>9}{:>11}{:>9}\n",
             "method", "samples", "step", "cell", "thr", "seconds", "setScene", "ns/ray", "fetches", "cells",
             "randoms", "RMSE", "PSNR", "FLIP", "bias", "to sync");
  for (const auto& row : result["points"]) {
    const auto number = [&](const char* name) { return row[name].get<double>(); };
    fmt::print("{:<11}{:>8}{:>6}{:>5}{:>4}{:>11.4g}{:>10.2g}{:>9.0f}{:>9.2f}{:>8.2f}{:>9.2f}",
               row["method"].get<std::string>(), row["samples"].get<std::uint32_t>(),
               row["step"].is_null() ? "" : fmt::format("{:g}", number("step")), row["macrocell"].get<int>(),
               row["threads"].get<int>(), number("seconds"), number("setSceneSeconds"), number("nsPerRay"),
               number("fetchesPerRay"), number("cellStepsPerRay"), number("randomBlocksPerRay"));
    if (row.contains("rmse"))
      fmt::print("{:>11.3e}{:>8.2f}{:>9.4f}{:>11.2e}", number("rmse"), number("psnr"), number("flip"),
                 number("bias"));
    if (row.contains("efficiencyToSyncDda"))
      fmt::print("{:>9}", fmt::format("x{:.2f}", number("efficiencyToSyncDda")));
    fmt::print("\n");
  }
}

}  // namespace scolopax::bench
