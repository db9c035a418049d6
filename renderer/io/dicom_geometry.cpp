// SPDX-License-Identifier: Apache-2.0
// Grids from the positions of DICOM slices.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>

#include "renderer/core/error.h"
#include "renderer/io/dicom_series.h"

namespace scolopax::io {
namespace {

std::string shortDicomNumber(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// The steps that differ by more than 1 %, ascending, as "1, 2 and 4 mm".
std::string differentDicomSteps(std::vector<double> steps) {
  constexpr std::size_t kMostNamed = 4;
  std::ranges::sort(steps);
  std::vector<double> different;
  for (const double step : steps)
    if (different.empty() || step > different.back() * 1.01) different.push_back(step);
  std::string text;
  const std::size_t named = std::min(different.size(), kMostNamed);
  for (std::size_t i = 0; i < named; ++i)
    text += (i == 0 ? "" : i + 1 == different.size() ? " and " : ", ") + shortDicomNumber(different[i]);
  if (named < different.size()) text += " to " + shortDicomNumber(different.back());
  return text + " mm";
}

/// Slices that lack if all steps are multiples of the smallest one; 0 otherwise.
std::size_t missingDicomSlices(const std::vector<double>& steps) {
  const double smallest = std::ranges::min(steps);
  double missing = 0;
  for (const double step : steps) {
    const double multiple = std::round(step / smallest);
    if (std::abs(step - multiple * smallest) > 0.01 * step) return 0;
    missing += multiple - 1;
  }
  return std::size_t(std::min(missing, 1e6));
}

}  // namespace

Grid dicomGrid(const DicomFile& file, const DicomFrame& first, std::size_t slices, const glm::dvec3& step) {
  const auto axes = first.axes.value_or(std::array{glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)});
  const glm::dvec2 spacing = first.spacing.value_or(glm::dvec2(1));
  const glm::dvec3 rasFromLps(-1, -1, 1);
  Grid grid{{int(file.columns), int(file.rows), int(slices)}};
  grid.worldFromVoxel = glm::dmat4(
      glm::dvec4(rasFromLps * axes[0] * spacing.x, 0), glm::dvec4(rasFromLps * axes[1] * spacing.y, 0),
      glm::dvec4(rasFromLps * step, 0), glm::dvec4(rasFromLps * first.position.value_or(glm::dvec3(0)), 1));
  return grid;
}

glm::dvec3 evenStep(const std::vector<glm::dvec3>& positions, const glm::dvec3& normal,
                    const std::string& name, const Warn& warn) {
  constexpr double kTolerance = 0.01, kSmallestAngle = 0.1, kDegrees = 57.29577951308232;
  const double intervals = double(positions.size() - 1);
  const glm::dvec3 step = (positions.back() - positions.front()) / intervals;
  const double mean = glm::dot(step, normal);
  std::vector<double> steps;
  for (std::size_t i = 1; i < positions.size(); ++i)
    steps.push_back(glm::dot(positions[i] - positions[i - 1], normal));
  if (std::ranges::any_of(steps, [&](double one) { return !(std::abs(one - mean) <= kTolerance * mean); })) {
    const std::size_t missing = missingDicomSlices(steps);
    throw Error(ErrorCode::unsupported,
                name + ": expected even distances of slices, found steps of " + differentDicomSteps(steps) +
                    (missing > 0 ? ", as if " + std::to_string(missing) + " were missing" : "") +
                    "; uneven grids cannot be shown");
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double off = glm::length(positions[i] - positions[0] - double(i) * step);
    if (!(off <= kTolerance * mean * intervals && off <= mean / 2))
      throw Error(ErrorCode::unsupported, name + ": expected slices in a straight row, found one " +
                                              shortDicomNumber(off) + " mm beside it");
  }
  const double angle = std::acos(std::min(mean / glm::length(step), 1.0)) * kDegrees;
  if (angle > kSmallestAngle)
    warn(name + ": the slices are shifted against each other by " + shortDicomNumber(angle) +
         " degrees (a tilted gantry): the grid is oblique");
  return step;
}

}  // namespace scolopax::io
