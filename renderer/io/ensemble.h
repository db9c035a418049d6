// SPDX-License-Identifier: Apache-2.0
// Statistics over the members of an ensemble, which are the times of a file: volumes that show what the
// members have in common and where they differ.
#pragma once
#include <memory>
#include <string_view>

#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// Path of the volume with the statistics, after that of the volume with the members.
inline constexpr std::string_view kStatistics = "statistics";

/// The file, with another volume for each that has several times. Its channels are, for every channel X of
/// the members, "X mean", "X variance" (of the sample: divided by the number of members less one), "X
/// minimum" and "X maximum", as f32; a voxel that is not finite in some member is NaN in all of them.
/// Reading them reads every member once and keeps one at a time. In place, means and variances are updated as
/// by Welford (Technometrics 4, 1962), in double, and rounded to f32 after each member.
std::shared_ptr<const VolumeFile> withStatistics(std::shared_ptr<const VolumeFile> file);

}  // namespace scolopax::io
