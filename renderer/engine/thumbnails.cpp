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

/// Rows that are rendered at once while it is not known what they cost: those of a packet of rays.
constexpr int kPacketRows = 4;
/// A row is expected to take at most so many times the work of the costliest one so far. Rows differ, and so
/// do resolutions.
constexpr std::uint64_t kRowGrowth = 64;

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
                       std::uint64_t mostWork, const std::stop_token& stop)
    : launcher_(launcher),
      plan_(plan),
      method_(method),
      mostWork_(mostWork),
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

/// As many rows as should not pass the limit, or those of a packet, which may pass it by their own work.
int Thumbnails::rowsAtOnce() const {
  if (workOfRow_ == 0) return kPacketRows;
  const std::uint64_t rows = (mostWork_ - work_) / (kRowGrowth * workOfRow_);
  if (rows >= std::uint64_t(view_.height)) return view_.height;
  return std::max(1, int(rows) / kPacketRows) * kPacketRows;
}

/// Renders rows of one sample into `pixels`, those of a whole picture.
Thumbnails::Work Thumbnails::renderRows(std::uint32_t sample, int firstRow, int rows,
                                        std::vector<glm::vec4>& pixels) {
  const auto width = std::size_t(view_.width), first = width * std::size_t(firstRow),
             count = width * std::size_t(rows);
  done_.assign(pixels.size(), 1);
  std::fill_n(done_.begin() + std::ptrdiff_t(first), count, std::uint8_t(0));
  cost_.assign(pixels.size(), {});
  const Pass pass{.plan = &plan_,
                  .method = method_,
                  .scene = view_,
                  .number = sampleNumber(Sampling::independent, sample),
                  .pixels = pixels.data(),
                  .cost = cost_.data(),
                  .done = done_.data(),
                  .cancel = &stopped_,
                  .deadline = std::chrono::steady_clock::time_point::max()};
  if (!launcher_.launch(pass)) throw Error(ErrorCode::cancelled, "rendering thumbnails was cancelled");
  Work work;
  for (const kernel::SampleCost& ray : cost_) {
    work.fetches += ray.fetches;
    work.cellSteps += ray.cellSteps;
  }
  rays_ += count;
  work_ += work.all();
  workOfRow_ = std::max(workOfRow_, work.all() / std::uint64_t(rows));
  return work;
}

std::optional<Pictures> Thumbnails::render(const Resolution& resolution, std::size_t count) {
  setResolution(view_, resolution);
  const std::size_t pixels = std::size_t(view_.width) * std::size_t(view_.height);
  Pictures pictures{resolution, 0, {}};
  std::uint64_t fetches = 0;
  if (work_ > mostWork_) return std::nullopt;
  while (pictures.samples.size() < count) {
    const auto sample = std::uint32_t(pictures.samples.size());
    std::vector<glm::vec4>& picture = pictures.samples.emplace_back(pixels);
    for (int row = 0; row < view_.height;) {
      const int rows = std::min(rowsAtOnce(), view_.height - row);
      fetches += renderRows(sample, row, rows, picture).fetches;
      if (work_ > mostWork_) return std::nullopt;
      row += rows;
    }
  }
  pictures.fetches = double(fetches) / double(count * pixels);
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
