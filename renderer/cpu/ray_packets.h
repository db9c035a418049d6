// SPDX-License-Identifier: Apache-2.0
// Quadrature (kernel/raymarch.h) of eight rays at once, where that is possible: the same pictures bit by bit,
// but where rounding decides whether a ray meets a cell.
#pragma once
#include "renderer/cpu/pass.h"

namespace scolopax {

/// For passes without record of first collisions; null where the scene or the processor needs kernels that go
/// ray by ray.
TileFunction packetTileFunction(const Scene& scene, const kernel::SceneView& view);

}  // namespace scolopax
