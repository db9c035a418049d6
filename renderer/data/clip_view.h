// SPDX-License-Identifier: Apache-2.0
// Converts a scene's clip planes and crop to the form that kernels use.
#pragma once
#include <optional>
#include <span>

#include "renderer/data/clipping.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/views/clip_view.h"

namespace scolopax {

/// Throws Error(badInput) for too many planes, for a plane that is not finite or has a zero normal, for a
/// channel that does not exist, and for crop planes that are not finite or out of order.
void checkClipping(std::span<const ClipPlane> planes, const std::optional<Crop>& crop, std::size_t channels);

/// The part of the volume that remains, in voxel coordinates. Bit n of a plane's channels stands for
/// visible[n], an index in the volume. None if nothing remains.
std::optional<kernel::ClipView> clipView(std::span<const ClipPlane> planes, const std::optional<Crop>& crop,
                                         const Grid& grid, std::span<const int> visible);

}  // namespace scolopax
