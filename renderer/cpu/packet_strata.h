// SPDX-License-Identifier: Apache-2.0
// What the rays of a packet absorb, gathered in strata that wait for light until there are as many as lanes.
#pragma once
#include "renderer/cpu/packet_light.h"
#include "renderer/cpu/packet_sampler.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// kernel::Strata.
class PacketStrata {
 public:
  SCOLOPAX_SIMD PacketStrata(PacketSampler& sampler, PacketCost* cost) : sampler_(sampler), cost_(cost) {
    all_.weight = floats(0.0f);
    all_.t = all_.draw = all_.weight;
    present_ = y_ = z_ = ints(0);
  }

  SCOLOPAX_SIMD void add(int n, Mask which, Float weight, const Vec& emission, Float t) {
    const Mask fresh = which & (all_.weight == floats(0.0f));
    if (any(fresh)) {
      const PacketSampler::Block random = sampler_.next(fresh);
      cost_->randomBlocks = cost_->randomBlocks + onesOf(fresh);
      all_.draw = select(fresh, uniformOf(random.x), all_.draw);
      y_ = select(fresh, random.y, y_);
      z_ = select(fresh, random.z, z_);
      present_ = select(fresh, ints(0), present_);
    }
    Channel& channel = channels_[n];
    const Int bit = ints(int(1u << n));
    const Mask begins = without(which, (present_ & bit) == bit);
    if (any(begins)) {
      present_ = select(begins, present_ | bit, present_);
      const Float zero = floats(0.0f), draw = uniformOf(y_ + ints(int(std::uint32_t(n) * 0x9e3779b9u)));
      channel.place = {select(begins, zero, channel.place.weight), select(begins, draw, channel.place.draw),
                       select(begins, zero, channel.place.t)};
      channel.emission = select(begins, vectors(glm::vec3(0.0f)), channel.emission);
    }
    channel.emission = select(which, channel.emission + emission, channel.emission);
    choose(channel.place, which, weight, t);
    choose(all_, which, weight, t);
  }

  /// Those that have so much weight wait for light, and begin anew.
  template <class Light>
  SCOLOPAX_SIMD void hand(Mask which, LightQueue& queue, Light& light, float (*colors)[kLanes]) {
    for (unsigned left = bitsOf(which); left != 0; left &= left - 1) {
      if (queue.count == kLanes) light.shine(queue, colors);
      const int i = std::countr_zero(left), slot = queue.count++;
      queue.lane[slot] = i;
      queue.t[slot] = at(all_.t, i);
      queue.offset[slot] = kernel::uniformOf(std::uint32_t(at(z_, i)));
      const auto present = std::uint32_t(at(present_, i));
      queue.channels[slot] = std::int32_t(present);
      for (std::uint32_t bits = present; bits != 0; bits &= bits - 1) {
        const int n = std::countr_zero(bits);
        const Channel& from = channels_[n];
        LightQueue::Channel& to = queue.channel[n];
        to.weight[slot] = at(from.place.weight, i);
        to.t[slot] = at(from.place.t, i);
        for (int c = 0; c < 3; ++c) to.emission[c][slot] = at(from.emission[c], i);
      }
    }
    all_.weight = select(which, floats(0.0f), all_.weight);
  }
  SCOLOPAX_SIMD Float weight() const { return all_.weight; }

 private:
  struct Place {
    Float weight, draw, t;
  };
  struct Channel {
    Place place;
    Vec emission;
  };
  SCOLOPAX_SIMD static void choose(Place& place, Mask which, Float weight, Float t) {
    const Float one = floats(1.0f), sum = place.weight + weight, chance = weight / sum;
    const Mask here = place.draw < chance;
    const Float rest = select(here, place.draw / chance, (place.draw - chance) / (one - chance));
    place.weight = select(which, sum, place.weight);
    place.t = select(which & here, t, place.t);
    place.draw = select(which, rest, place.draw);
  }

  PacketSampler& sampler_;
  PacketCost* cost_;
  Place all_;
  Int present_, y_, z_;
  Channel channels_[kernel::kMaxVisibleChannels];
};

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
