// SPDX-License-Identifier: Apache-2.0
#include "renderer/engine/corrections.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <span>
#include <string>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/data/sampling.h"

namespace scolopax {
namespace {

/// Cost of the corrections that are rendered with one sample, in samples. More would let corrections that are
/// due be completed earlier, but leave longer between two samples.
constexpr double kCostPerSample = 3;

}  // namespace

void Corrections::reset(std::vector<Level> levels) {
  *this = {};
  levels_ = std::move(levels);
}

void Corrections::beginRows(const Film& film, const std::function<bool()>& addLevel) {
  stage_ = Stage::complete;
  if (!underway_) {
    auto due = dueLevel(levels_, film.samples() + 1, film);
    if (due == film.levels() && !addLevel())
      due = dueLevel(std::span(levels_).first(film.levels()), film.samples() + 1, film);
    if (!due) return;
    underway_ = true;
    level_ = *due;
    endRow_ = 0;
  }
  const int rows = int(std::ceil(film.height() * kCostPerSample / levels_[level_].estimate.cost));
  firstRow_ = endRow_;
  endRow_ = std::min(film.height(), firstRow_ + std::max(1, rows));
  stage_ = Stage::fine;
  markRows(film);
}

void Corrections::markRows(const Film& film) {
  const auto width = std::size_t(film.width());
  try {
    done_.assign(film.pixelCount(), 1);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::tooLarge, "image: no memory for the corrections of " +
                                         std::to_string(film.width()) + "x" + std::to_string(film.height()) +
                                         " pixels");
  }
  std::fill(done_.begin() + std::ptrdiff_t(width * std::size_t(firstRow_)),
            done_.begin() + std::ptrdiff_t(width * std::size_t(endRow_)), std::uint8_t(0));
}

bool Corrections::render(Launcher& launcher, const RenderPlan& plan, Film& film,
                         const std::function<bool()>& addLevel, kernel::SampleCost* cost,
                         const std::atomic<bool>& cancel, std::chrono::steady_clock::time_point deadline) {
  if (stage_ == Stage::notBegun) beginRows(film, addLevel);
  if (stage_ == Stage::complete) return true;
  Pass pass{.plan = &plan,
            .method = plan.scene().method,
            .scene = plan.view(),
            .number = sampleNumber(plan.scene().sampling, film.corrections(level_)),
            .pixels = nullptr,  // each picture has its own
            .cost = cost,
            .done = done_.data(),
            .cancel = &cancel,
            .deadline = deadline};
  // Independent of the samples of the film and of the other levels.
  pass.scene.seed = kernel::hashOf(plan.scene().seed + 0x9e3779b9u * std::uint32_t(level_ + 1));
  const auto renderAt = [&](const Resolution& resolution, glm::vec4* pixels) {
    pass.pixels = pixels;
    setResolution(pass.scene, resolution);
    return launcher.launch(pass);
  };
  const LevelEstimate& level = levels_[level_].estimate;
  if (stage_ == Stage::fine) {
    if (!renderAt(level.fine, film.fine())) return false;
    stage_ = Stage::coarse;
    markRows(film);
  }
  if (!renderAt(level.coarse, film.coarse())) return false;
  stage_ = Stage::complete;
  return true;
}

void Corrections::add(Film& film) {
  stage_ = Stage::notBegun;
  if (!underway_ || endRow_ < film.height()) return;
  film.addCorrection(level_);
  if (!film.isIncluded(level_) && isEnough(levels_[level_], film.corrections(level_), film.samples()))
    film.include(level_);
  underway_ = false;
}

}  // namespace scolopax
