// SPDX-License-Identifier: Apache-2.0
// The measurements of `bench`: settings, the points (time, error) measured for them, and the results.
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
  double step;  ///< in smallest voxel spacings; 0 for methods without one
  int macrocell, threads;
};

struct Point : Setting {
  std::vector<double> seconds, squaredErrors;  ///< for every repetition; no errors without a reference
  std::vector<glm::dvec4> sum;                 ///< of the pictures of all repetitions
  double flip = 0;                             ///< of the first repetition
  RenderStats counts;                          ///< of one sample
  double rebuildMs = 0;                        ///< of the first setScene, without building macrocells
  std::uint32_t samplesTimed = 0;

  double time() const;  ///< median, seconds
  double mse() const;
  double efficiency() const { return 1 / (mse() * time()); }
};

/// The squared error that remains when pictures with independent seeds are averaged. The squared error of one
/// picture is bias^2 + noise, that of the mean of k pictures is bias^2 + noise / k. 0 if the noise hides the
/// bias.
double squaredBias(const Point& point, const Image& truth);

/// Rows "points", one per point, and "timeToError", one per method, macrocell size and number of threads: the
/// time to an RMSE of 1e-2 and of 1e-3, and the samples and step that reach it; null if the measurements do
/// not show it. For methods without a step, it is extrapolated by the law of their noise from the most
/// samples measured. For methods with a step, it is that of the best step, extrapolated by the same law above
/// the bias and to at most kMaxReach times the samples measured, since a bias well below the noise cannot be
/// seen. Without `truth`, times and counts only.
nlohmann::ordered_json report(const std::vector<Point>& points, const std::optional<Image>& truth,
                              std::size_t pixels);
inline constexpr double kMaxReach = 16;

/// Prints the result of report() as a table.
void print(const nlohmann::ordered_json& result);

}  // namespace scolopax::bench
