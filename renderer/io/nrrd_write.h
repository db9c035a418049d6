// SPDX-License-Identifier: Apache-2.0
// Writes volumes as NRRD.
#pragma once
#include <filesystem>
#include <span>

#include "renderer/data/volume.h"

namespace scolopax::io {

/// Writes an attached, raw-encoded NRRD (LPS space) with the channels as the slowest axis; all must have one
/// type.
void writeNrrd(const std::filesystem::path& path, const Grid& grid, std::span<const ChannelSource> channels);

}  // namespace scolopax::io
