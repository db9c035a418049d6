// SPDX-License-Identifier: Apache-2.0
// Small volumes of random voxels for the scene tester, and files of them, with which a failing scene can be
// rendered again.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "renderer/data/volume.h"

namespace scolopax::random_scenes {

/// The input of Volume, kept because Volume moves factors from its voxels to slope and intercept.
struct VolumeSource {
  Grid grid;
  std::vector<ChannelSource> channels;
};

/// 1 to 6 voxels a side, 1 to 4 channels of any type; grid, slopes and intercepts are floats.
VolumeSource drawVolume(std::uint64_t scene);
/// A short line: size, spacing, types, and the kind of voxels.
std::string describe(const VolumeSource& source);
/// One NIfTI file per channel, channel_0.nii and so on, in `folder`, exactly as drawn.
std::vector<std::filesystem::path> writeVolume(const VolumeSource& source,
                                               const std::filesystem::path& folder);

}  // namespace scolopax::random_scenes
