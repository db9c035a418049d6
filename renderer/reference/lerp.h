// SPDX-License-Identifier: Apache-2.0
// Linear interpolation between voxels.
#pragma once

namespace scolopax::reference {

/// Exact at both ends, and where a and b are equal. The outer half voxels lie at u = 1, where a huge
/// neighbour must not wipe out b. (std::lerp is exact there too, but several times slower.)
inline double lerpExact(double a, double b, double u) { return u == 1 ? b : a + u * (b - a); }

}  // namespace scolopax::reference
