// SPDX-License-Identifier: Apache-2.0
#include "renderer/cpu/ray_packets.h"

#include <algorithm>
#include <bit>

#include "renderer/cpu/packet_sampler.h"
#include "renderer/cpu/packet_walk.h"
#include "renderer/cpu/sample_batch.h"
#include "renderer/kernel/blend_modes.h"
#include "renderer/kernel/raymarch.h"

namespace scolopax {
#if defined(__x86_64__)
namespace {

using namespace lanes;
using kernel::ChannelView;
using kernel::OpticalCurveView;
using kernel::OpticalKnot;
using kernel::SceneView;

/// Pixels of a packet: neighbours, which share voxels and macrocells.
constexpr int kPacketWidth = 4, kPacketHeight = kLanes / kPacketWidth;
static_assert(kLanes == kernel::kBatchPoints && kTile % kPacketWidth == 0 && kTile % kPacketHeight == 0);

/// Where rays are on a channel's curves, and on which piece.
struct Place {
  Float position;
  Int piece;
};

struct Knots {
  Float position, inverseWidth, opacity, color[3];
};
constexpr int kKnotFloats = sizeof(OpticalKnot) / sizeof(float);

SCOLOPAX_AVX2 Knots knotsAt(const OpticalCurveView& curve, Int index) {
  const Int at = index * ints(kKnotFloats);
  const OpticalKnot& first = curve.knots[0];
  return {gather(&first.position, at),
          gather(&first.inverseWidth, at),
          gather(&first.opacity, at),
          {gather(&first.color.x, at), gather(&first.color.y, at), gather(&first.color.z, at)}};
}
SCOLOPAX_AVX2 Knots sameKnot(const OpticalKnot& knot) {
  return {floats(knot.position),
          floats(knot.inverseWidth),
          floats(knot.opacity),
          {floats(knot.color.x), floats(knot.color.y), floats(knot.color.z)}};
}

/// kernel::pieceAt.
SCOLOPAX_AVX2 Int piecesAt(const OpticalCurveView& curve, Float position) {
  const Mask above = position >= floats(0.0f), inside = above & (position < floats(1.0f));
  Int k = gather(curve.buckets, truncated(where(inside, position) * floats(float(kernel::kCurveBuckets))));
  for (;;) {
    const Int following = minimum(k + ints(1), ints(curve.count - 1));
    const Mask on = inside & (gather(&curve.knots[0].position, following * ints(kKnotFloats)) <= position);
    if (!any(on)) break;
    k = k + onesOf(on);
  }
  return select(inside, k, select(above, ints(curve.count - 1), ints(-1)));
}

/// kernel::Optical.
struct Opticals {
  Float opacity, color[3];
};
/// kernel::opticalIn.
SCOLOPAX_AVX2 Opticals opticalsIn(const Knots& a, const Knots& b, Int piece, Float position) {
  const Float along = minimum((position - a.position) * a.inverseWidth, floats(1.0f));
  const Float t = where(piece > ints(-1), along);
  Opticals optical{a.opacity + t * (b.opacity - a.opacity), {}};
  for (int i = 0; i < 3; ++i) optical.color[i] = a.color[i] + t * (b.color[i] - a.color[i]);
  return optical;
}

/// What channels do together on a segment of every ray, per world unit.
struct Sums {
  Float extinction, emission[3];
};
SCOLOPAX_AVX2 Sums nothing() {
  const Float zero = floats(0.0f);
  return {zero, {zero, zero, zero}};
}

/// Adds kernel::partAlone of a channel for some rays.
SCOLOPAX_AVX2 void addParts(const ChannelView& channel, const Place& from, const Place& to, Mask wanted,
                            Sums* sums) {
  const OpticalCurveView& curve = channel.optical;
  const Float p = from.position, q = to.position;
  const Float first = floats(curve.first), last = floats(curve.last);
  const Mask outside = ((p <= first) & (q <= first)) | ((p >= last) & (q >= last));
  const Mask seen = without(wanted, outside);
  if (!any(seen)) return;
  const Mask linear = seen & (from.piece == to.piece) & (p == p) & (q == q);
  Float opacity = floats(0.0f), emission[3] = {opacity, opacity, opacity};
  if (any(linear)) {
    const Float density = floats(channel.density);
    const Int lane = ints(std::countr_zero(bitsOf(linear)));
    const Int same{_mm256_permutevar8x32_epi32(from.piece.v, lane.v)};
    Knots a, b;
    if (!any(without(linear, from.piece == same))) {
      const int k = firstOf(same);
      a = sameKnot(curve.knots[k < 0 ? 0 : k]);
      b = sameKnot(curve.knots[k < 0 ? 0 : std::min(k + 1, curve.count - 1)]);
    } else {
      a = knotsAt(curve, maximum(from.piece, ints(0)));
      b = knotsAt(curve, minimum(from.piece + ints(1), ints(curve.count - 1)));
    }
    const Opticals u = opticalsIn(a, b, from.piece, p), v = opticalsIn(a, b, from.piece, q);
    opacity = where(linear, floats(0.5f) * (u.opacity + v.opacity) * density);
    const Float two = floats(2.0f), left = two * u.opacity + v.opacity, right = u.opacity + two * v.opacity;
    for (int i = 0; i < 3; ++i)
      emission[i] = where(linear, floats(0.166666667f) * (left * u.color[i] + right * v.color[i]) * density);
  }
  if (const unsigned others = bitsOf(without(seen, linear))) {
    // Stretches over knots or beside voxels that are not finite.
    float ends[2][kLanes], parts[4][kLanes];
    store(p, ends[0]), store(q, ends[1]);
    store(opacity, parts[0]);
    for (int i = 0; i < 3; ++i) store(emission[i], parts[1 + i]);
    for (unsigned left = others; left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      const float positions[] = {ends[0][i], ends[1][i]};
      const kernel::Part part = kernel::partAlone(channel, positions);
      parts[0][i] = part.opacity;
      for (int c = 0; c < 3; ++c) parts[1 + c][i] = part.emission[c];
    }
    opacity = load(parts[0]);
    for (int i = 0; i < 3; ++i) emission[i] = load(parts[1 + i]);
  }
  const Mask some = opacity > floats(0.0f);
  sums->extinction = sums->extinction + where(some, opacity);
  for (int i = 0; i < 3; ++i) sums->emission[i] = sums->emission[i] + where(some, emission[i]);
}

/// Rays of a packet, their light so far and what they have cost.
struct Packet {
  SCOLOPAX_AVX2 Packet() {
    for (Float* const sum : {&color[0], &color[1], &color[2], &opacity}) *sum = floats(0.0f);
    for (Int* const count : {&fetches, &cellSteps, &truncated}) *count = ints(0);
  }
  Rays rays;
  Intervals inside;
  Float color[3], opacity;
  Int fetches, cellSteps, truncated;
};

/// kernel::marchRay for eight rays.
class March {
 public:
  SCOLOPAX_AVX2 March(const SceneView& scene, Packet& packet, int only, Float offset)
      : scene_(scene),
        packet_(packet),
        channels_(only >= 0                  ? 1u << only
                  : scene.channelCount == 32 ? ~0u
                                             : (1u << scene.channelCount) - 1),
        fetchesOfPoint_(std::popcount(channels_)),
        offset_(offset),
        live_(packet.inside.meets) {}

  SCOLOPAX_AVX2 void follow() {
    const Intervals& inside = packet_.inside;
    PacketWalk walk(packet_.rays, inside, scene_.majorants);
    Float transmittance = floats(1.0f);
    Float color[3] = {floats(0.0f), floats(0.0f), floats(0.0f)}, opacity = floats(0.0f);
    live_ = live_ & walk.meets();
    if (!any(live_)) return;
    int sampled = -2;  // segment whose end was sampled last
    int taken = 0;
    for (int k = firstSegment(walk.enter()); any(live_);) {
      const Float start = k > 0 ? endOf(k - 1) : inside.enter, end = endOf(k);
      if (!meetsSomething(walk, start, end)) {
        k = std::max(k + 1, firstSegment(select(walk.full(), walk.enter(), walk.exit())));
        continue;
      }
      if (++taken > kernel::kMaxSegments) {
        packet_.truncated = packet_.truncated + onesOf(live_);
        break;
      }
      if (sampled != k - 1) sample(start, current_);
      sampled = k;
      sample(end, next_);
      Sums sums = nothing();
      for (int n = 0; n < scene_.channelCount; ++n) {
        if (!(channels_ >> n & 1)) continue;
        addParts(scene_.channels[n], current_[n], next_[n], live_, &sums);
        current_[n] = next_[n];
      }
      const Mask some = sums.extinction > floats(0.0f);
      if (any(some)) {
        const Float alpha = absorbed(sums.extinction * (end - start));
        const Float absorbedHere = transmittance * alpha;
        const Float scale = where(some, absorbedHere / sums.extinction);
        for (int i = 0; i < 3; ++i) color[i] = color[i] + sums.emission[i] * scale;
        opacity = opacity + absorbedHere;
        transmittance = transmittance * (floats(1.0f) - alpha);
      }
      live_ = live_ & (transmittance > floats(kernel::kOpaqueTransmittance)) & (end < inside.exit);
      ++k;
    }
    const Float own = minimum(opacity, floats(1.0f));
    for (int i = 0; i < 3; ++i) packet_.color[i] = packet_.color[i] + color[i];
    packet_.opacity = packet_.opacity + (floats(1.0f) - packet_.opacity) * own;
  }

 private:
  SCOLOPAX_AVX2 Float endOf(int segment) const {
    return minimum(packet_.inside.enter + (floats(float(segment)) + offset_) * floats(scene_.step),
                   packet_.inside.exit);
  }

  /// Whether a ray is in a cell that is not empty between these places. If none is, the walk has gone on to
  /// the next such cell of every ray or some way there, and rays that have none left have ended.
  SCOLOPAX_AVX2 bool meetsSomething(PacketWalk& walk, Float start, Float end) {
    walk.jump(start);
    packet_.cellSteps = packet_.cellSteps + onesOf(live_);
    for (;;) {
      if (any(live_ & walk.full() & (walk.enter() < end))) return true;
      walk.measure();
      live_ = live_ & (walk.full() | (walk.exit() < packet_.inside.exit));
      if (!any(live_ & (walk.exit() < end))) return false;
      const Mask moving = without(live_, walk.full());
      walk.advance(moving);
      packet_.cellSteps = packet_.cellSteps + onesOf(moving);
    }
  }

  /// First segment that has one of these points, of rays that have not ended.
  SCOLOPAX_AVX2 int firstSegment(Float t) const {
    const Float place = (t - packet_.inside.enter) / floats(scene_.step) - offset_ + floats(1.0f);
    return int(kernel::clamp(smallestOf(select(live_, place, floats(kernel::kInfinity))), 0.0f, 1e9f));
  }

  SCOLOPAX_AVX2 void sample(Float t, Place* places) {
    kernel::PointBatch points;
    store(packet_.rays.origin[0] + t * packet_.rays.direction[0], points.x);
    store(packet_.rays.origin[1] + t * packet_.rays.direction[1], points.y);
    store(packet_.rays.origin[2] + t * packet_.rays.direction[2], points.z);
    float stored[kernel::kMaxVisibleChannels][kLanes];
    scene_.sampleBatch(scene_, channels_, points, stored);
    for (int n = 0; n < scene_.channelCount; ++n) {
      if (!(channels_ >> n & 1)) continue;
      const ChannelView& channel = scene_.channels[n];
      places[n].position = positionsOf(channel, stored[n]);
      places[n].piece = piecesAt(channel.optical, places[n].position);
    }
    packet_.fetches = packet_.fetches + onesOf(live_) * ints(fetchesOfPoint_);
  }

  /// kernel::stretchPosition.
  SCOLOPAX_AVX2 static Float positionsOf(const ChannelView& channel, const float* stored) {
    if (channel.gamma != 1.0f) {
      float positions[kLanes];
      for (int i = 0; i < kLanes; ++i) positions[i] = kernel::stretchPosition(channel, stored[i]);
      return load(positions);
    }
    const Float value = load(stored), far = floats(1e6f);
    const Float position =
        clamp((value - floats(channel.origin)) * floats(channel.scale) + floats(channel.offset),
              floats(0.0f) - far, far);
    return select(isFinite(value), position, floats(__builtin_nanf("")));
  }

  const SceneView& scene_;
  Packet& packet_;
  std::uint32_t channels_;
  int fetchesOfPoint_;
  Float offset_;
  Mask live_;
  Place current_[kernel::kMaxVisibleChannels], next_[kernel::kMaxVisibleChannels];
};

/// kernel::RenderPixel for the pixels of a packet from (x, y) on, as far as they are below (endX, endY).
template <class Blend>
SCOLOPAX_AVX2_ONLY void renderPacket(const Pass& pass, int x, int y, int endX, int endY) {
  const SceneView& scene = pass.scene;
  std::int32_t columns[kLanes], rows[kLanes], pixels[kLanes];
  unsigned todo = 0;
  for (int i = 0; i < kLanes; ++i) {
    const int column = x + i % kPacketWidth, row = y + i / kPacketWidth;
    columns[i] = column, rows[i] = row;
    pixels[i] = row * scene.width + column;
    if (column < endX && row < endY && !pass.done[pixels[i]]) todo |= 1u << i;
  }
  if (todo == 0) return;
  PacketSampler sampler(load(pixels), pass.number, scene.seed);
  Float across = floats(0.5f), down = across;
  const PacketSampler::Block jitter = sampler.next();
  if (scene.filterBox) across = uniformOf(jitter.x), down = uniformOf(jitter.y);
  Packet packet;
  packet.rays = raysThrough(scene.rays, toFloat(load(columns)) + across, toFloat(load(rows)) + down);
  packet.inside = clipToBox(packet.rays, scene.dims);
  const Int bit{_mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128)};
  packet.inside.meets = packet.inside.meets & ((ints(int(todo)) & bit) == bit);
  if (scene.channelCount > 0 && any(packet.inside.meets))
    for (int n = 0; n < (Blend::kSeparate ? scene.channelCount : 1); ++n)
      March(scene, packet, Blend::kSeparate ? n : -1, uniformOf(sampler.next().x)).follow();

  float rgba[4][kLanes];
  for (int i = 0; i < 3; ++i) store(packet.color[i], rgba[i]);
  store(packet.opacity, rgba[3]);
  std::int32_t fetches[kLanes], cellSteps[kLanes], truncated[kLanes];
  store(packet.fetches, fetches), store(packet.cellSteps, cellSteps), store(packet.truncated, truncated);
  for (; todo != 0; todo &= todo - 1) {
    const int i = std::countr_zero(todo), pixel = pixels[i];
    pass.pixels[pixel] = {rgba[0][i], rgba[1][i], rgba[2][i], rgba[3][i]};
    if (pass.cost) {
      pass.cost[pixel].fetches += std::uint32_t(fetches[i]);
      pass.cost[pixel].cellSteps += std::uint32_t(cellSteps[i]);
      pass.cost[pixel].randomBlocks += sampler.blocks();
      pass.cost[pixel].truncated += std::uint32_t(truncated[i]);
    }
    pass.done[pixel] = 1;
  }
}

template <class Blend>
void renderTilePackets(const Pass& pass, int tileX, int tileY) {
  const int endX = std::min((tileX + 1) * kTile, pass.scene.width);
  const int endY = std::min((tileY + 1) * kTile, pass.scene.height);
  for (int y = tileY * kTile; y < endY; y += kPacketHeight) {
    if (std::chrono::steady_clock::now() >= pass.deadline) return;
    for (int x = tileX * kTile; x < endX; x += kPacketWidth) {
      if (pass.cancel->load(std::memory_order_relaxed)) return;
      renderPacket<Blend>(pass, x, y, endX, endY);
    }
  }
}

}  // namespace

TileFunction packetTileFunction(const Scene& scene, const kernel::SceneView& view) {
  const auto cells = glm::dvec3(view.majorants.cells);
  if (!hasStep(scene.method) || !available(InstructionSet::avx2) || cells.x * cells.y * cells.z >= 0x1p30)
    return nullptr;
  if (scene.shading || scene.shadows) return nullptr;
  if (scene.blend == BlendMode::density) return renderTilePackets<kernel::BlendDensity>;
  if (scene.blend == BlendMode::composite) return renderTilePackets<kernel::BlendComposite>;
  return nullptr;
}
#else
TileFunction packetTileFunction(const Scene&, const kernel::SceneView&) { return nullptr; }
#endif

}  // namespace scolopax
