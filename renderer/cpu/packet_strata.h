// SPDX-License-Identifier: Apache-2.0
// What the rays of a packet absorb, in strata (kernel/strata.h) that wait for light until there are as many
// as lanes.
#pragma once
#include "renderer/cpu/packet_light.h"
#include "renderer/cpu/packet_sampler.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// kernel::Strata.
template <class Features>
class PacketStrata {
 public:
  /// `only` >= 0: of that channel alone.
  SCOLOPAX_SIMD PacketStrata(const kernel::SceneView& scene, const Rays& rays, std::uint32_t channels,
                             int only, const PacketSampler& sampler, PacketCost* cost)
      : light_(scene, rays, channels, cost),
        stratum_(floats(scene.stratum)),
        perLight_(floats(1.0f / scene.stratum)),
        block_(ints(std::max(only, 0) * (int(1.0f / scene.stratum) + 1))),
        sampler_(sampler),
        cost_(cost) {
    begin_ = mass_ = next_ = first_ = offset_ = shared_ = place_ = floats(0.0f);
    index_ = chain_ = kept_ = ints(0);
    radiance_ = emission_ = vectors(glm::vec3(0.0f));
    std::fill(std::begin(colors_), std::end(colors_), glm::vec3(0.0f));
  }

  /// Takes a segment that absorbs [before, after) of the rays' light and without lights would send out
  /// `emission` of it. `parts` are those of its channels and add up to `extinction`.
  SCOLOPAX_SIMD void absorb(Float before, Float after, const PacketSegment& segment, Float extinction,
                            const Vec& emission, const Parts* parts) {
    const Mask on = after > before;
    if (!any(on)) return;
    mass_ = select(on, after - begin_, mass_);
    emission_ = select(on, emission_ + emission, emission_);
    const Mask fresh = on & (next_ == floats(0.0f));
    if (any(fresh)) draw(fresh);
    const Mask beyond = on & (mass_ > stratum_), moves = without(on, beyond | (mass_ < next_));
    Float place = select(beyond, shared_ * mass_, floats(-1.0f));
    if (any(moves)) place = select(moves, largestRecord(moves), place);
    const Mask here = on & (place >= before - begin_);
    if (any(here)) keep(here, segment, extinction, parts);
    const Int reached = truncated(after * perLight_);
    const Mask full = on & (reached > index_);
    if (!any(full)) return;
    hand(full);
    const Float zero = floats(0.0f);
    index_ = select(full, reached, index_);
    begin_ = select(full, after, begin_);
    next_ = select(full, zero, next_);
    emission_ = select(full, vectors(glm::vec3(0.0f)), emission_);
    mass_ = select(full, zero, mass_);
  }

  /// Of all that was absorbed.
  SCOLOPAX_SIMD Vec finish() {
    hand(mass_ > floats(0.0f));
    if (queue_.count > 0) light_.shine(queue_, colors_);
    light_.finish(colors_);
    float rows[3][kLanes];
    for (int i = 0; i < kLanes; ++i)
      for (int c = 0; c < 3; ++c) rows[c][i] = colors_[i][c];
    return {{load(rows[0]), load(rows[1]), load(rows[2])}};
  }

 private:
  SCOLOPAX_SIMD void draw(Mask which) {
    const PacketSampler::Block random = sampler_.at(block_ + index_, which);
    cost_->randomBlocks = cost_->randomBlocks + onesOf(which);
    first_ = select(which, uniformOf(random.x) * stratum_, first_);
    chain_ = select(which, random.y, chain_);
    offset_ = select(which, uniformOf(random.z), offset_);
    shared_ = select(which, uniformOf(hashOf(random.z)), shared_);
  }

  SCOLOPAX_SIMD Float largestRecord(Mask which) {
    Float record = first_, next = floats(kernel::kInfinity);
    Int chain = chain_;
    for (;;) {
      const Mask above = which & (record > mass_);
      if (!any(above)) break;
      next = select(above, record, next);
      record = select(above, record * uniformOf(chain), record);
      chain = select(above, hashOf(chain + ints(int(0x9e3779b9u))), chain);
    }
    next_ = select(which, next, next_);
    return record;
  }

  SCOLOPAX_SIMD void keep(Mask which, const PacketSegment& segment, Float extinction, const Parts* parts) {
    Float opacity = floats(0.0f), moment = opacity;
    kept_ = select(which, ints(0), kept_);
    radiance_ = select(which, vectors(glm::vec3(0.0f)), radiance_);
    for (std::uint32_t left = segment.channels; left != 0; left &= left - 1) {
      const int n = std::countr_zero(left);
      const Parts& own = parts[n];
      opacity = opacity + own.opacity;
      moment = moment + own.moment;
      const Mask seen = which & (own.opacity > floats(kernel::kLeastNormal));
      if (!any(seen)) continue;
      kept_ = kept_ | where(seen, ints(int(1u << n)));
      const Float inverse = floats(1.0f) / own.opacity;
      Channel& channel = channels_[n];
      channel.share = select(seen, own.opacity / extinction, channel.share);
      const Vec emission{{own.emission[0], own.emission[1], own.emission[2]}};
      channel.color = select(seen, emission * inverse, channel.color);
      radiance_ = select(seen, radiance_ + channel.color * channel.share, radiance_);
    }
    const Float length = segment.end - segment.start;
    const Float centre = minimum(moment / opacity, floats(1.0f));
    const Float place = segment.start + length * placeOfAbsorption(extinction * length, centre);
    place_ = select(which, place, place_);
  }

  /// kernel::placeOfAbsorption.
  SCOLOPAX_SIMD static Float placeOfAbsorption(Float depth, Float centre) {
    const Float one = floats(1.0f), two = floats(2.0f);
    const Float thin = centre * (one - depth * floats(0.166666667f));
    const Mask isThin = depth < floats(0.25f);
    if (!any(without(everywhere(), isThin))) return thin;
    const Float alpha = absorbed(depth);
    return select(isThin, thin, centre * (two / depth - two * (one - alpha) / alpha));
  }

  /// These wait for light.
  SCOLOPAX_SIMD void hand(Mask which) {
    for (unsigned left = bitsOf(which); left != 0; left &= left - 1) {
      if (queue_.count == kLanes) light_.shine(queue_, colors_);
      const int i = std::countr_zero(left), slot = queue_.count++;
      queue_.lane[slot] = i;
      queue_.mass[slot] = at(mass_, i);
      queue_.t[slot] = at(place_, i);
      queue_.offset[slot] = at(offset_, i);
      for (int c = 0; c < 3; ++c) {
        queue_.radiance[slot][c] = at(radiance_[c], i);
        queue_.emission[slot][c] = at(emission_[c], i);
      }
      const auto kept = std::uint32_t(at(kept_, i));
      queue_.channels[slot] = std::int32_t(kept);
      for (std::uint32_t bits = kept; bits != 0; bits &= bits - 1) {
        const int n = std::countr_zero(bits);
        LightQueue::Channel& to = queue_.channel[n];
        to.share[slot] = at(channels_[n].share, i);
        for (int c = 0; c < 3; ++c) to.color[c][slot] = at(channels_[n].color[c], i);
      }
    }
  }

  struct Channel {
    Float share;
    Vec color;
  };
  PacketLight<Features> light_;
  LightQueue queue_;
  glm::vec3 colors_[kLanes];
  Float stratum_, perLight_;
  Int block_;
  const PacketSampler& sampler_;
  PacketCost* cost_;
  Float begin_, mass_, next_, first_, offset_, shared_, place_;
  Vec radiance_, emission_;
  Int index_, chain_, kept_;
  Channel channels_[kernel::kMaxVisibleChannels];
};

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
