// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/ray_packets.h"

#include <glm/vec3.hpp>

namespace scolopax {

TileFunction packetTileFunction(const Instance& instance, const kernel::SceneView& view, InstructionSet set) {
  const auto cells = glm::dvec3(view.majorants.cells);
  // The walk of a packet has cell indices of 32 bits.
  if (!hasStep(instance.method) || cells.x * cells.y * cells.z >= 0x1p30) return nullptr;
  switch (set) {
    case InstructionSet::avx512:
      return avx512PacketTiles(instance);
    case InstructionSet::avx2:
      return avx2PacketTiles(instance);
    case InstructionSet::baseline:
      break;
  }
  return nullptr;
}

}  // namespace scolopax
