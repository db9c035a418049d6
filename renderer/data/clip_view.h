// SPDX-License-Identifier: Apache-2.0
// From a scene's clip planes and crop to what kernels need of them.
#pragma once
#include <optional>
#include <span>

#include "renderer/data/clipping.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/views.h"

namespace scolopax {

/// Throws Error(badInput) for a plane or channel that cannot be, and for crop planes that are out of order.
void checkClipping(std::span<const ClipPlane> planes, const std::optional<Crop>& crop, std::size_t channels);

/// What is left of the volume and of the given channels, by their order; nothing if nothing is.
std::optional<kernel::ClipView> clipView(std::span<const ClipPlane> planes, const std::optional<Crop>& crop,
                                         const Grid& grid, std::span<const int> visible);

}  // namespace scolopax
