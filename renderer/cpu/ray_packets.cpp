// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/ray_packets.h"

#include <glm/vec3.hpp>

#include "renderer/data/instances.h"

namespace scolopax {

TileFunction packetTileFunction(const Scene& scene, const kernel::SceneView& view, InstructionSet set) {
  const auto cells = glm::dvec3(view.majorants.cells);
  // The walk of a packet has cell indices of 32 bits.
  if (!hasStep(scene.method) || cells.x * cells.y * cells.z >= 0x1p30) return nullptr;
  switch (set) {
    case InstructionSet::avx512:
      return avx512PacketTiles(scene, view.cutsAtVoxels());
    case InstructionSet::avx2:
      return avx2PacketTiles(scene, view.cutsAtVoxels());
    case InstructionSet::baseline:
      break;
  }
  return nullptr;
}

TileFunction quadratureTileFunction(const Scene& scene, const kernel::SceneView& view) {
  const TileFunction packets = packetTileFunction(scene, view, fastestInstructionSet());
  if (packets) return packets;
  return view.cutsAtVoxels() ? chooseTileFunction<kernel::RayMarch<kernel::VoxelCells>>(scene)
                             : chooseTileFunction<kernel::RayMarch<kernel::EqualSteps>>(scene);
}

}  // namespace scolopax
