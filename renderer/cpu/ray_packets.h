// SPDX-License-Identifier: Apache-2.0
// Quadrature (kernel/raymarch.h) of many rays at once, where that is possible: the same pictures bit by bit,
// but where rounding decides whether a ray meets a cell.
#pragma once
#include "renderer/cpu/instruction_set.h"
#include "renderer/cpu/pass.h"

namespace scolopax {

/// The fastest there is for quadrature; packets record no first collisions.
TileFunction quadratureTileFunction(const Scene& scene, const kernel::SceneView& view);

/// Packets alone, by a set that the processor has; null where it has none or the scene needs kernels that go
/// ray by ray.
TileFunction packetTileFunction(const Scene& scene, const kernel::SceneView& view, InstructionSet set);

/// Those of an instruction set, each compiled in a file of its own: of 8 and 16 rays.
TileFunction avx2PacketTiles(const Scene& scene);
TileFunction avx512PacketTiles(const Scene& scene);

}  // namespace scolopax
