// SPDX-License-Identifier: Apache-2.0
// Quadrature (kernel/raymarch.h) of packets of rays, where that is possible. Gives the same pictures as
// single rays, bit for bit, except where rounding decides whether a ray intersects a cell.
#pragma once
#include "renderer/cpu/instruction_set.h"
#include "renderer/cpu/tile_function.h"

namespace scolopax {

/// Packets with instruction set `set`, which the processor must support. Null where only single rays are
/// possible: for the baseline set, for methods other than quadrature, whose rays diverge, and for volumes of
/// 2^30 macrocells or more, which a packet's walk cannot index.
TileFunction packetTileFunction(const Instance& instance, const kernel::SceneView& view, InstructionSet set);

/// Packets of 8 and 16 rays. Each is compiled for its instruction set in a file of its own; null except on
/// x86-64.
TileFunction avx2PacketTiles(const Instance& instance);
TileFunction avx512PacketTiles(const Instance& instance);

}  // namespace scolopax
