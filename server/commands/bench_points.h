// SPDX-License-Identifier: Apache-2.0
// What bench measures: settings, the points (time, error) that they become, and what follows from them.
#pragma once
#include <cstdint>
#include <glm/vec4.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "renderer/data/image.h"
#include "renderer/renderer.h"

namespace scolopax::bench {

struct Setting {
  Method method;
  std::uint32_t samples;
  double step;  ///< of methods that have one, in smallest spacings; else 0
  int macrocell, threads;
};

struct Point : Setting {
  std::vector<double> seconds, squaredErrors;  ///< of every repetition; no errors without a truth
  std::vector<glm::dvec4> sum;                 ///< of the pictures of all repetitions
  double flip = 0;                             ///< of the first repetition
  RenderStats counts;                          ///< of one sample
  double rebuildMs = 0;                        ///< of the first setScene, macrocells apart
  std::uint32_t samplesTimed = 0;

  double time() const;  ///< median, seconds
  double mse() const;
  double efficiency() const { return 1 / (mse() * time()); }
};

/// Squared error that stays when pictures of independent seeds are averaged: that of the mean of k pictures
/// is bias^2 + noise / k, of one bias^2 + noise. 0 where the noise hides it.
double squaredBias(const Point& point, const Image& truth);

/// Rows "points", one per point, and "timeToError", one per method, macrocell size and number of threads:
/// the time to an RMSE of 1e-2 and 1e-3, with the samples and the step that reach it, null where nothing
/// measured says. Of methods without a step by the law of their noise, from the most samples measured; of
/// the others at the best step, by that law above their bias and over at most kLongestReach times the
/// samples measured, since a bias well below the noise cannot be told. Without `truth` times and counts only.
nlohmann::ordered_json report(const std::vector<Point>& points, const std::optional<Image>& truth,
                              std::size_t pixels);
inline constexpr double kLongestReach = 16;

/// The table of what report() gave.
void print(const nlohmann::ordered_json& result);

}  // namespace scolopax::bench
