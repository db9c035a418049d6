// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__) && !defined(SCOLOPAX_WITHOUT_AVX512)
#include "renderer/cpu/lanes_avx512.h"
// After the lane type.
#include "renderer/cpu/packet_tiles.h"
#endif
#include "renderer/cpu/ray_packets.h"

namespace scolopax {

TileFunction avx512PacketTiles([[maybe_unused]] const Instance& instance) {
#if defined(__x86_64__) && !defined(SCOLOPAX_WITHOUT_AVX512)
  return lanes_avx512::packetTiles(instance);
#else
  return nullptr;
#endif
}

}  // namespace scolopax
