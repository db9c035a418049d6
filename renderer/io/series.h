// SPDX-License-Identifier: Apache-2.0
// Time series in several files: one file for each step, which differ in a number in their names.
#pragma once
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// The file name without its last number, and that number: "run01_0025.vti" is "run01_", 25, ".vti". Numbers
/// of a single digit do not count, nor do those after "c", "ch", "channel", "w", "wave" or "z", which count
/// other things than steps.
struct NumberedName {
  std::string_view before, after;
  double number = 0;
  bool numbered = false;
};
NumberedName numberedName(std::string_view filename);

/// The least number of files that are taken for a series.
inline constexpr std::size_t kLeastSteps = 3;

/// Joins files in one folder, if at least kLeastSteps of them have names that differ in their number only,
/// each holds a single step, and their volumes have the same paths, grids and channels, with the same units
/// and scales. Of files with the same number, only the first joins. A series takes the place of its first
/// file and has the path of that with the least number, its steps are sorted by number, and its files become
/// its dataFiles. Other files stay as they are.
std::vector<std::shared_ptr<const VolumeFile>> joinSeries(
    std::span<const std::shared_ptr<const VolumeFile>> files);

}  // namespace scolopax::io
