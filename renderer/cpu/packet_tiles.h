// SPDX-License-Identifier: Apache-2.0
// Quadrature of a packet of rays, and tiles of such packets. Included by the files that compile it for an
// instruction set.
#pragma once
#include <algorithm>
#include <bit>

#include "renderer/cpu/packet_light.h"
#include "renderer/cpu/packet_march.h"
#include "renderer/cpu/packet_sampler.h"
#include "renderer/cpu/packet_strata.h"
#include "renderer/cpu/pass.h"
#include "renderer/data/instances.h"
#include "renderer/kernel/blend_modes.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// Pixels of a packet: neighbours, which share voxels and macrocells.
inline constexpr int kPacketWidth = 4, kPacketHeight = kLanes / kPacketWidth;
static_assert(kTile % kPacketWidth == 0 && kTile % kPacketHeight == 0);

/// What is left behind a part of the rays, and what that has absorbed: kernel::marchRay's sums.
struct Absorption {
  Float transmittance, opacity;
  SCOLOPAX_SIMD Absorption() : transmittance(floats(1.0f)), opacity(floats(0.0f)) {}

  /// Goes over a segment; returns its share of the light for every unit of extinction, 0 where there is none.
  SCOLOPAX_SIMD Float pass(Float extinction, Float length) {
    const Mask some = extinction > floats(0.0f);
    // Masked, because the lengths of rays that miss the volume may not be numbers.
    const Float alpha = absorbed(where(some, extinction * length));
    const Float absorbedHere = transmittance * alpha;
    opacity = opacity + absorbedHere;
    transmittance = transmittance * (floats(1.0f) - alpha);
    return where(some, absorbedHere / extinction);
  }
  SCOLOPAX_SIMD Mask lets() const { return transmittance > floats(kernel::kOpaqueTransmittance); }
};

/// Emission and absorption.
class Glow {
 public:
  SCOLOPAX_SIMD explicit Glow(const kernel::SceneView& scene)
      : color(vectors(glm::vec3(0.0f))), scene_(scene) {}

  SCOLOPAX_SIMD Mask take(const PacketSegment& segment) {
    Float extinction = floats(0.0f);
    Vec emission = vectors(glm::vec3(0.0f));
    for (std::uint32_t left = segment.channels; left != 0; left &= left - 1) {
      const int n = std::countr_zero(left);
      const Parts parts = partsOf<Detail::emission>(scene_.channels[n], segment.from[n], segment.to[n],
                                                    segment.of(scene_, n));
      extinction = extinction + parts.opacity;
      for (int c = 0; c < 3; ++c) emission[c] = emission[c] + parts.emission[c];
    }
    if (any(extinction > floats(0.0f)))
      color = color + emission * absorption.pass(extinction, segment.end - segment.start);
    return absorption.lets();
  }
  SCOLOPAX_SIMD void finish() {}

  Vec color;
  Absorption absorption;

 private:
  const kernel::SceneView& scene_;
};

/// Light that channels throw back.
template <class Features>
class Reflection {
 public:
  SCOLOPAX_SIMD Reflection(const kernel::SceneView& scene, const Rays& rays, std::uint32_t channels, int only,
                           const PacketSampler& ofStrata, PacketCost* cost)
      : strata_(scene, rays, channels, only, ofStrata, cost), scene_(scene) {}

  SCOLOPAX_SIMD Mask take(const PacketSegment& segment) {
    Float extinction = floats(0.0f);
    Vec emission = vectors(glm::vec3(0.0f));
    for (std::uint32_t left = segment.channels; left != 0; left &= left - 1) {
      const int n = std::countr_zero(left);
      parts_[n] =
          partsOf<Detail::moment>(scene_.channels[n], segment.from[n], segment.to[n], segment.of(scene_, n));
      extinction = extinction + parts_[n].opacity;
      for (int c = 0; c < 3; ++c) emission[c] = emission[c] + parts_[n].emission[c];
    }
    if (!any(extinction > floats(0.0f))) return absorption.lets();
    const Float before = absorption.opacity;
    const Float scale = absorption.pass(extinction, segment.end - segment.start);
    strata_.absorb(before, absorption.opacity, segment, extinction, emission * scale, parts_);
    return absorption.lets();
  }
  SCOLOPAX_SIMD void finish() { color = strata_.finish(); }

  Vec color;
  Absorption absorption;

 private:
  PacketStrata<Features> strata_;
  Parts parts_[kernel::kMaxVisibleChannels];
  const kernel::SceneView& scene_;
};

/// Rays of a packet, their light so far and what they have cost.
struct Packet {
  SCOLOPAX_SIMD Packet() : color(vectors(glm::vec3(0.0f))), opacity(floats(0.0f)), cost(noCost()) {}
  Rays rays;
  Intervals inside;
  Vec color;
  Float opacity;
  PacketCost cost;
};

/// kernel::marchRay of all channels or of `only` one, added to the packet's.
template <class Features>
SCOLOPAX_SIMD void march(const kernel::SceneView& scene, int only, Float offset,
                         const PacketSampler& ofStrata, Packet& packet) {
  const std::uint32_t channels = only < 0 ? ~0u >> (32 - scene.channelCount) : 1u << only;
  PacketMarch along(scene, packet.rays, packet.inside, channels, offset, scene.step, &packet.cost);
  const auto add = [&](auto& sink) SCOLOPAX_SIMD_ONLY {
    along.follow(sink);
    sink.finish();
    packet.color = packet.color + sink.color;
    const Float one = floats(1.0f), opacity = minimum(sink.absorption.opacity, one);
    packet.opacity = packet.opacity + (one - packet.opacity) * opacity;
  };
  if constexpr (Features::kAny) {
    Reflection<Features> reflection(scene, packet.rays, channels, only, ofStrata, &packet.cost);
    add(reflection);
  } else {
    Glow glow(scene);
    add(glow);
  }
}

/// kernel::RenderPixel for the pixels of a packet from (x, y) on, as far as they are below (endX, endY).
template <class Blend, class Features>
SCOLOPAX_SIMD_ONLY void renderPacket(const Pass& pass, int x, int y, int endX, int endY) {
  const kernel::SceneView& scene = pass.scene;
  std::int32_t pixels[kLanes];
  unsigned todo = 0;
  for (int i = 0; i < kLanes; ++i) {
    const int column = x + i % kPacketWidth, row = y + i / kPacketWidth;
    pixels[i] = row * scene.width + column;
    if (column < endX && row < endY && !pass.done[pixels[i]]) todo |= 1u << i;
  }
  if (todo == 0) return;
  // Not what was stored one by one: a load that has to wait for many stores is slow.
  const Int columns = ints(x) + (laneNumbers() & ints(kPacketWidth - 1));
  const Int rows = ints(y) + right<std::countr_zero(unsigned(kPacketWidth))>(laneNumbers());
  const Mask wanted = maskOf(todo);
  PacketSampler sampler(rows * ints(scene.width) + columns, pass.number, scene.seed);
  const PacketSampler ofStrata = sampler.aside();
  Float across = floats(0.5f), down = across;
  const PacketSampler::Block jitter = sampler.next(wanted);
  if (scene.filterBox) across = uniformOf(jitter.x), down = uniformOf(jitter.y);
  Packet packet;
  packet.rays = raysThrough(scene.rays, toFloat(columns) + across, toFloat(rows) + down);
  packet.inside = clipToBox(packet.rays, scene.dims);
  packet.inside.meets = packet.inside.meets & wanted;
  if (scene.channelCount > 0 && any(packet.inside.meets)) {
    for (int n = 0; n < (Blend::kSeparate ? scene.channelCount : 1); ++n) {
      const Float offset = uniformOf(sampler.next(packet.inside.meets).x);
      march<Features>(scene, Blend::kSeparate ? n : -1, offset, ofStrata, packet);
    }
  }

  float values[4][kLanes];
  for (int c = 0; c < 3; ++c) store(packet.color[c], values[c]);
  store(packet.opacity, values[3]);
  for (; todo != 0; todo &= todo - 1) {
    const int i = std::countr_zero(todo), pixel = pixels[i];
    pass.pixels[pixel] = {values[0][i], values[1][i], values[2][i], values[3][i]};
    if (pass.cost) {
      pass.cost[pixel].fetches += std::uint32_t(at(packet.cost.fetches, i));
      pass.cost[pixel].cellSteps += std::uint32_t(at(packet.cost.cellSteps, i));
      pass.cost[pixel].randomBlocks += std::uint32_t(at(packet.cost.randomBlocks + sampler.blocks(), i));
      pass.cost[pixel].truncated += at(packet.cost.truncated, i) > 0;
    }
    pass.done[pixel] = 1;
  }
}

template <class Blend, class Features>
void renderTilePackets(const Pass& pass, int tileX, int tileY) {
  const int endX = std::min((tileX + 1) * kTile, pass.scene.width);
  const int endY = std::min((tileY + 1) * kTile, pass.scene.height);
  for (int y = tileY * kTile; y < endY; y += kPacketHeight) {
    if (std::chrono::steady_clock::now() >= pass.deadline) return;
    for (int x = tileX * kTile; x < endX; x += kPacketWidth) {
      if (pass.cancel->load(std::memory_order_relaxed)) return;
      renderPacket<Blend, Features>(pass, x, y, endX, endY);
    }
  }
}

/// Null where the scene's blend mode is none that adds up.
inline TileFunction packetTiles(const Scene& scene) {
  return visitBlendAndLight(scene, [](auto blend, auto features) -> TileFunction {
    using Blend = typename decltype(blend)::type;
    if constexpr (Blend::kSums)
      return renderTilePackets<Blend, typename decltype(features)::type>;
    else
      return nullptr;  // channels that hide each other are compared along a segment, which packets do not
  });
}

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
