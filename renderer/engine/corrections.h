// SPDX-License-Identifier: Apache-2.0
// Renders the corrections of multi-level quadrature, a few rows with every sample of a film.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <vector>

#include "renderer/data/film.h"
#include "renderer/data/render_plan.h"
#include "renderer/engine/levels.h"
#include "renderer/launcher.h"

namespace scolopax {

class Corrections {
 public:
  /// Begins anew, for an empty film.
  void reset(std::vector<Level> levels);
  const std::vector<Level>& levels() const { return levels_; }

  /// Renders what is due with the next sample of the film. Returns false if `cancel` became true or the
  /// deadline passed; the next call resumes. `addLevel` adds a level to the film; if it returns false, the
  /// level begins later. `cost` is as in Pass. Runs in the caller's thread arena, like Launcher::launch.
  bool render(Launcher& launcher, const RenderPlan& plan, Film& film, const std::function<bool()>& addLevel,
              kernel::SampleCost* cost, const std::atomic<bool>& cancel,
              std::chrono::steady_clock::time_point deadline);
  /// Adds what render() has completed to the film. Call together with Film::add().
  void add(Film& film);

 private:
  enum class Stage { notBegun, fine, coarse, complete };
  void beginRows(const Film& film, const std::function<bool()>& addLevel);
  void markRows(const Film& film);

  std::vector<Level> levels_;
  bool underway_ = false;  // a correction of `level_` is partly rendered
  std::size_t level_ = 0;
  int firstRow_ = 0, endRow_ = 0;  // rows that are rendered with this sample; those before are complete
  Stage stage_ = Stage::notBegun;
  std::vector<std::uint8_t> done_;  // as in Pass: also set for all rows that are not due
};

}  // namespace scolopax
