// SPDX-License-Identifier: Apache-2.0
// The default appearance. It is chosen from the data alone, never from the user's edits, so that editing one
// value does not change another.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax {

/// The window that the file states. Otherwise by percentile, never empty: a single channel shows the upper
/// half of its values; each of several channels shows its top 8 %, so that what distinguishes them is visible
/// rather than what they have in common.
ValueRange defaultRange(const VolumeFacts& volume, int channel);

/// sRGB bytes, distinct for neighbouring indices.
std::array<std::uint8_t, 3> defaultColor(int index);
/// The colour that the file states for the channel; otherwise that of its index.
std::array<std::uint8_t, 3> defaultColor(const VolumeFacts& volume, int channel);

/// Colour map of a volume's only channel; with several channels, each has a single colour.
inline constexpr std::string_view kDefaultColormap = "plasma";

/// Density, per world unit, at which a linear ramp over the default range shows both the outside and some of
/// the inside.
double defaultDensity(const VolumeFacts& volume, int channel);

}  // namespace scolopax
