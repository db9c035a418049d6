// SPDX-License-Identifier: Apache-2.0
// The schedule of multi-level quadrature (Giles, "Multilevel Monte Carlo methods", Acta Numerica 24, 2015).
// With Q_0, Q_1, ... the pictures at ever finer resolutions, the exact picture is
// E[Q_0] + E[Q_1 - Q_0] + E[Q_2 - Q_1] + ... The samples of a film are pictures Q_0; a level's corrections
// are differences Q_l - Q_(l-1), both from the same random numbers. They are small and have little noise, so
// few of them are needed.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "renderer/data/film.h"
#include "renderer/data/resolution.h"

namespace scolopax {

/// What a level's corrections are expected to be. Sizes are RMS values over linear premultiplied RGBA.
struct LevelEstimate {
  Resolution fine, coarse;
  double cost;      ///< of one correction, in samples of the film
  double size;      ///< of the expected correction
  double most;      ///< the same, one standard deviation above the estimate
  double variance;  ///< of one correction
};

/// When a level's corrections are rendered.
struct Level {
  LevelEstimate estimate;
  std::uint32_t from;  ///< number of samples at which the level begins
  double first;        ///< number of corrections with which it begins, so that they are better than none
  double perSample;    ///< total number of corrections per sample of the film
};

/// A schedule on which every pass goes where it reduces the squared error most for its cost. `variance` is
/// that of a sample of the film. `estimates` are those of levels 1, 2, ...; their sizes and variances must
/// not be negative.
std::vector<Level> scheduleLevels(double variance, std::span<const LevelEstimate> estimates);

/// The level, as an index of `levels`, whose next correction is due in a film with this many samples: the
/// first of those that have the smallest fraction of their corrections. A level begins after the one before
/// it.
std::optional<std::size_t> dueLevel(std::span<const Level> levels, std::uint32_t samples, const Film& film);

/// Whether this many corrections improve the picture of a film with this many samples.
bool isEnough(const Level& level, std::uint32_t corrections, std::uint32_t samples);

/// Estimated RMS bias of the film's picture: of the levels that are not included yet, and of all finer
/// resolutions.
double biasLeft(std::span<const Level> levels, const Film& film);

}  // namespace scolopax
