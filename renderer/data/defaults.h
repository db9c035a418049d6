// SPDX-License-Identifier: Apache-2.0
// What a scene that says nothing looks like: chosen from the data alone, never from the user's edits, so
// that one edit does not move another value.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax {

struct ValueRange {
  double lo, hi;  ///< data units, lo < hi
};

/// By percentile, never empty: of an only channel the upper half of its values, of several the top twelfth of
/// each, so that what they mark shows instead of what they have in common.
ValueRange defaultRange(const Volume& volume, int channel);

/// sRGB bytes, distinct for neighbouring indices.
std::array<std::uint8_t, 3> defaultColor(int index);

/// Colour map of the only channel of a volume; several channels have one colour each.
inline constexpr std::string_view kDefaultColormap = "plasma";

/// Density, per world unit, at which a linear ramp over the default range shows both the outside and some of
/// the inside.
double defaultDensity(const Volume& volume, int channel);

}  // namespace scolopax
