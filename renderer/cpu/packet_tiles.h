// SPDX-License-Identifier: Apache-2.0
// Quadrature of packets of rays, one ray per lane, and tiles of such packets. Included after a lane type by
// the files that compile it for an instruction set.
#pragma once
#include <algorithm>
#include <bit>

#include "renderer/cpu/sample_lanes.h"
#include "renderer/cpu/tile_function.h"
#include "renderer/data/instances.h"
#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/raymarch.h"
#include "renderer/kernel/render_pixel.h"

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// Pixels of a packet: neighbours, because their rays share voxels and macrocells.
inline constexpr int kPacketWidth = 4, kPacketHeight = kLanes / kPacketWidth;
static_assert(kTile % kPacketWidth == 0 && kTile % kPacketHeight == 0);

/// Does what kernel::RenderPixel does, for a packet of pixels whose top left one is (x, y). Skips pixels that
/// are already done and those with a column >= endX or a row >= endY.
template <class Steps, class Lighting, class Blend>
SCOLOPAX_LANES_APART void renderPacket(const Pass& pass, const Blend& blend, int x, int y, int endX,
                                       int endY) {
  const kernel::SceneView& scene = pass.scene;
  std::int32_t pixels[kLanes];
  unsigned todo = 0;
  for (int i = 0; i < kLanes; ++i) {
    const int column = x + i % kPacketWidth, row = y + i / kPacketWidth;
    pixels[i] = row * scene.width + column;
    if (column < endX && row < endY && !pass.done[pixels[i]]) todo |= 1u << i;
  }
  if (todo == 0) return;
  // Not loaded from `pixels`, which is stored element by element: a load that must wait for many stores is
  // slow.
  const Int columns = Int(x) + (laneNumbers() & Int(kPacketWidth - 1));
  const Int rows = Int(y) + right<std::countr_zero(unsigned(kPacketWidth))>(laneNumbers());
  const Mask wanted = maskOf(todo);
  kernel::SamplerOf<Lanes> sampler(rows * scene.width + columns, pass.number, scene.seed);
  kernel::PixelRay<Lanes> from = kernel::rayThrough<Lanes>(scene, columns, rows, sampler, wanted);
  from.inside.exit = where(wanted, from.inside.exit);
  kernel::CostOf<Lanes> cost{};
  kernel::FirstCollisionOf<Lanes> met{};
  kernel::Radiance<Lanes> radiance{Vec(0.0f), Float(0.0f)};
  if (scene.channelCount > 0 && any(from.inside.enter < from.inside.exit))
    radiance = kernel::RayMarch<Steps>::template march<Lighting>(scene, blend, from.ray, from.inside, sampler,
                                                                 &cost, pass.first ? &met : nullptr);
  if (scene.isCancelled()) return;
  if (pass.first) met.depth = scene.rays.depth(from.x, from.y, met.depth);
  for (; todo != 0; todo &= todo - 1) {
    const int i = std::countr_zero(todo), pixel = pixels[i];
    pass.pixels[pixel] = {at(radiance.color[0], i), at(radiance.color[1], i), at(radiance.color[2], i),
                          at(radiance.opacity, i)};
    if (pass.first) pass.first[pixel] = {at(met.depth, i), at(met.channel, i)};
    if (pass.cost) {
      pass.cost[pixel].fetches += std::uint32_t(at(cost.fetches, i));
      pass.cost[pixel].cellSteps += std::uint32_t(at(cost.cellSteps, i));
      pass.cost[pixel].randomBlocks += std::uint32_t(at(cost.randomBlocks + sampler.blocks(), i));
      pass.cost[pixel].truncated += at(cost.truncated, i) > 0;
    }
    pass.done[pixel] = 1;
  }
}

template <class Steps, class Lighting, bool kSums, bool kSeparate, bool kMixes>
void renderTilePackets(const Pass& pass, int tileX, int tileY) {
  const int endX = std::min((tileX + 1) * kTile, pass.scene.width);
  const int endY = std::min((tileY + 1) * kTile, pass.scene.height);
  for (int y = tileY * kTile; y < endY; y += kPacketHeight)
    for (int x = tileX * kTile; x < endX; x += kPacketWidth) {
      if (pass.scene.isCancelled() || std::chrono::steady_clock::now() >= pass.deadline) return;
      renderPacket<Steps, Lighting>(pass, kernel::Blending<kSums>{kSeparate, kMixes}, x, y, endX, endY);
    }
}

inline TileFunction packetTiles(const Instance& instance) {
  return visitBlendAndLight(instance,
                            [voxelwise = instance.voxelwise](auto blend, auto lighting) -> TileFunction {
                              using Blend = typename decltype(blend)::type;
                              using Lighting = typename decltype(lighting)::type;
                              return voxelwise ? renderTilePackets<kernel::VoxelCells, Lighting, Blend::kSums,
                                                                   Blend::kSeparate, Blend::kMixes>
                                               : renderTilePackets<kernel::EqualSteps, Lighting, Blend::kSums,
                                                                   Blend::kSeparate, Blend::kMixes>;
                            });
}

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
