// SPDX-License-Identifier: Apache-2.0
// Random numbers by counting: a bijection of (pixel, sample, block, seed), so that no two draws share a
// state and none depends on threads, tiles or processes; the first ones of low discrepancy. Integer only
// until the last step.
#pragma once
#include <cstdint>

#include "renderer/kernel/portable.h"

namespace scolopax::kernel {

/// Four words of 32 random bits.
struct RandomBlock {
  std::uint32_t x, y, z, w;
};

/// pcg4d of Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020: a permutation of 128
/// bits.
SCOLOPAX_HD inline RandomBlock pcg4d(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t w) {
  x = x * 1664525u + 1013904223u;
  y = y * 1664525u + 1013904223u;
  z = z * 1664525u + 1013904223u;
  w = w * 1664525u + 1013904223u;
  x += y * w, y += z * x, z += x * y, w += y * z;
  x ^= x >> 16, y ^= y >> 16, z ^= z >> 16, w ^= w >> 16;
  x += y * w, y += z * x, z += x * y, w += y * z;
  return {x, y, z, w};
}

/// (k + 1/2) 2^-32, at most 1 - 2^-24: never 0 or 1, and fine enough near 0 that a free flight through
/// optical thickness 1e-7 still has the right chance of a collision.
SCOLOPAX_HD inline float uniformOf(std::uint32_t k) {
  const float u = (float(k) + 0.5f) * 0x1p-32f;
  return u < 0x1.fffffep-1f ? u : 0x1.fffffep-1f;
}

/// A bijection of 32 bits whose output bits all depend on all input bits (Wellons, "Prospecting for Hash
/// Functions", 2018: lowbias32).
SCOLOPAX_HD inline std::uint32_t hashOf(std::uint32_t x) {
  x ^= x >> 16, x *= 0x7feb352du;
  x ^= x >> 15, x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

/// Blocks of a sample whose words x, y, z come from a Sobol sequence.
inline constexpr std::uint32_t kLowDiscrepancyBlocks = 3;
/// Consecutive samples of a pixel that share a scrambling. Between replicates samples are independent, so the
/// error of a picture can be estimated from them.
inline constexpr std::uint32_t kReplicateSamples = 64;

/// The part of a sample's numbers that all pixels share (data/sampling.h makes it).
struct SampleNumber {
  std::uint32_t sample;
  bool lowDiscrepancy;  ///< false: all draws independent
  /// Point sample % kReplicateSamples of the Sobol sequence, bits of each coordinate reversed.
  std::uint32_t point[kLowDiscrepancyBlocks][3];
};

SCOLOPAX_HD inline std::uint32_t reverseBits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/// Owen's nested uniform scrambling of a coordinate whose bits come reversed (Burley, "Practical Hash-based
/// Owen Scrambling", JCGT 9(4), 2020): every bit is flipped by a hash of the bits before it.
SCOLOPAX_HD inline std::uint32_t owenScramble(std::uint32_t reversed, std::uint32_t seed) {
  // The seed's lowest bit flips the coordinate's highest, and pcg4d's lowest bits are not random enough.
  std::uint32_t x = reversed + (seed ^ (seed >> 16));
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return reverseBits(x);
}

/// The draws of one sample of one pixel. Block 0 places the sample in the pixel; every tentative collision
/// takes the next block: x its optical depth, y the channel, z acceptance.
class Sampler {
 public:
  /// Borrows `number`.
  SCOLOPAX_HD Sampler(std::uint32_t pixel, const SampleNumber& number, std::uint32_t seed)
      : number_(number), pixel_(pixel), seed_(seed) {}
  SCOLOPAX_HD RandomBlock next() { return at(block_++); }
  /// Any block, in any order.
  SCOLOPAX_HD RandomBlock at(std::uint32_t block) const {
    if (!number_.lowDiscrepancy || block >= kLowDiscrepancyBlocks)
      return pcg4d(pixel_, number_.sample, block, seed_);
    // Samples stay below 2^31, so no other draw has this counter.
    const std::uint32_t replicate = 0x80000000u | (number_.sample / kReplicateSamples);
    const RandomBlock scrambling = pcg4d(pixel_, replicate, block, seed_);
    const std::uint32_t* point = number_.point[block];
    return {owenScramble(point[0], scrambling.x), owenScramble(point[1], scrambling.y),
            owenScramble(point[2], scrambling.z), scrambling.w};
  }
  /// How many next() has given.
  SCOLOPAX_HD std::uint32_t blocks() const { return block_; }
  SCOLOPAX_HD void skipTo(std::uint32_t block) { block_ = block; }
  /// Numbers apart from these, for a purpose whose need for them must not change what the others are. Pixels
  /// stay below 2^31.
  SCOLOPAX_HD Sampler aside() const { return Sampler(pixel_ | 0x80000000u, number_, seed_); }

 private:
  const SampleNumber& number_;
  std::uint32_t pixel_, seed_;
  std::uint32_t block_ = 0;
};

}  // namespace scolopax::kernel
