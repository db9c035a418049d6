// SPDX-License-Identifier: Apache-2.0
// Quadrature (kernel/raymarch.h) of many rays at once, where that is possible: the same pictures bit by bit,
// but where rounding decides whether a ray meets a cell.
#pragma once
#include "renderer/cpu/instruction_set.h"
#include "renderer/cpu/tile_function.h"

namespace scolopax {

/// The fastest there is for quadrature.
TileFunction quadratureTileFunction(const Scene& scene, const kernel::SceneView& view);

/// Packets alone, by a set that the processor has. Null, and left to single rays, are processors with no
/// other set than the baseline; methods other than quadrature, whose rays diverge; and volumes of 2^30
/// macrocells or more, which a packet's walk cannot count.
TileFunction packetTileFunction(const Scene& scene, const kernel::SceneView& view, InstructionSet set);

/// Those of an instruction set, each compiled in a file of its own: of 8 and 16 rays.
TileFunction avx2PacketTiles(const Scene& scene);
TileFunction avx512PacketTiles(const Scene& scene);

}  // namespace scolopax
