// SPDX-License-Identifier: Apache-2.0
// The results of `bench`: points (time, error) measured for settings, and what follows from them.
#pragma once
#include <cstdint>
#include <glm/vec4.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
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

/// Pictures with one setting, one for every repetition, each with its own seed.
struct Point : Setting {
  explicit Point(const Setting& setting) : Setting(setting) {}

  std::vector<double> seconds;          ///< of the samples, with their corrections
  std::vector<double> setSceneSeconds;  ///< before them; includes the choice of Method::automatic
  std::vector<double> squaredErrors;    ///< empty without a reference
  std::vector<double> estimates;  ///< estimated errors; empty of a single sample, and of steps, whose bias
                                  ///< takes long to estimate
  std::vector<glm::dvec4> sum;    ///< of the pictures of all repetitions
  double flip = 0;                ///< of the first repetition
  RenderStats counts;             ///< of the first `samplesCounted` samples, with their corrections
  std::uint32_t samplesCounted = 0;
  Choice choice{};       ///< of the last repetition
  double rebuildMs = 0;  ///< of the first setScene, without building macrocells
  std::uint32_t samplesTimed = 0;

  double time() const;          ///< median of `seconds`
  double setSceneTime() const;  ///< median of `setSceneSeconds`
  double mse() const;
  double efficiency() const { return 1 / (mse() * time()); }
};

/// Of the values, at least one; for an even number, the mean of the two in the middle.
double median(std::vector<double> values);

/// Whether an error remains after any number of samples: that of the step.
inline bool isBiased(const Point& point) { return hasStep(point.method); }
/// Whether a point's error falls by the law of its noise, squared errors with the number of samples, so that
/// more samples need not be measured. Not that of Method::automatic with corrections, which begin one after
/// another.
bool hasNoiseLaw(const Point& point);

/// The squared error that remains when pictures with independent seeds are averaged. The squared error of one
/// picture is bias^2 + noise, that of the mean of k pictures is bias^2 + noise / k. 0 if the noise hides the
/// bias.
double squaredBias(const Point& point, const Image& truth);

inline constexpr double kTargets[] = {1e-2, 1e-3, 1e-4, 1e-5};  ///< RMSE

/// The fastest way to an error.
struct Reached {
  double seconds;  ///< of setScene() and of the samples
  double samples, step;
};
/// How to reach an RMSE with one method, by its points in ascending order of samples; nullopt if the
/// measurements do not show it. Without a step, by the law of the noise, from the most samples measured.
/// With steps, with the best of them, by the same law above the bias and with at most kMaxReach times the
/// samples measured, since a bias well below the noise cannot be seen. For Method::automatic with
/// corrections, between the two points around it, interpolated in logarithms.
std::optional<Reached> reach(double rmse, std::span<const Point* const> points,
                             const std::optional<Image>& truth);
inline constexpr double kMaxReach = 16;

/// Rows "points", one per point, and "timeToError", one per method, macrocell size and number of threads: the
/// time to each of kTargets, and the samples and step that reach it; null if reach() does not know it.
/// Without `truth`, times and counts only.
nlohmann::ordered_json report(const std::vector<Point>& points, const std::optional<Image>& truth,
                              std::size_t pixels);

/// Prints the result of report() as a table.
void print(const nlohmann::ordered_json& result);

}  // namespace scolopax::bench
