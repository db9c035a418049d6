// SPDX-License-Identifier: Apache-2.0
// The random numbers of a packet of pixels at once: kernel/rng.h, which says what they are and where they are
// from.
#pragma once
#include "renderer/cpu/lanes.h"
#include "renderer/kernel/rng.h"
#if defined(__x86_64__)

namespace scolopax::SCOLOPAX_SIMD_SPACE {

/// kernel::uniformOf.
SCOLOPAX_SIMD Float uniformOf(Int k) {
  // Both halves are exact, so that their sum is rounded as the number itself would be.
  const Float whole = toFloat(right<16>(k)) * floats(65536.0f) + toFloat(k & ints(0xffff));
  return minimum((whole + floats(0.5f)) * floats(0x1p-32f), floats(0x1.fffffep-1f));
}

/// kernel::hashOf.
SCOLOPAX_SIMD Int hashOf(Int x) {
  x = (x ^ right<16>(x)) * ints(0x7feb352d);
  x = (x ^ right<15>(x)) * ints(int(0x846ca68bu));
  return x ^ right<16>(x);
}

/// kernel::Sampler, for blocks of which the first three words are wanted; every pixel at a block of its own.
class PacketSampler {
 public:
  struct Block {
    Int x, y, z;
  };
  SCOLOPAX_SIMD PacketSampler(Int pixels, const kernel::SampleNumber& number, std::uint32_t seed)
      : pixels_(pixels), number_(number), seed_(seed), block_(ints(0)) {}

  /// The others stay where they are, and get anything.
  SCOLOPAX_SIMD Block next(Mask which) {
    const Int block = block_;
    block_ = block_ + onesOf(which);
    return at(block, which);
  }
  /// kernel::Sampler::at.
  SCOLOPAX_SIMD Block at(Int block, Mask which) const {
    const Mask low = ints(number_.lowDiscrepancy ? int(kernel::kLowDiscrepancyBlocks) : 0) > block;
    const Block random = pcg4d(ints(int(number_.sample)), block);
    if (!any(low & which)) return random;
    const Int replicate = word(0x80000000u | (number_.sample / kernel::kReplicateSamples));
    const Block scrambling = pcg4d(replicate, block);
    const Int row = minimum(block, ints(int(kernel::kLowDiscrepancyBlocks) - 1)) * ints(3);
    return {select(low, owenScramble(point(row, 0), scrambling.x), random.x),
            select(low, owenScramble(point(row, 1), scrambling.y), random.y),
            select(low, owenScramble(point(row, 2), scrambling.z), random.z)};
  }
  SCOLOPAX_SIMD Int blocks() const { return block_; }
  /// kernel::Sampler::aside.
  SCOLOPAX_SIMD PacketSampler aside() const {
    return PacketSampler(pixels_ | word(0x80000000u), number_, seed_);
  }

 private:
  SCOLOPAX_SIMD static Int word(std::uint32_t k) { return ints(int(k)); }
  SCOLOPAX_SIMD Int point(Int row, int column) const { return gather(&number_.point[0][column], row); }

  SCOLOPAX_SIMD Block pcg4d(Int sample, Int block) const {
    const Int factor = word(1664525u), term = word(1013904223u);
    Int x = pixels_ * factor + term, y = sample * factor + term, z = block * factor + term;
    Int w = word(seed_ * 1664525u + 1013904223u);
    x = x + y * w, y = y + z * x, z = z + x * y, w = w + y * z;
    x = x ^ right<16>(x), y = y ^ right<16>(y), z = z ^ right<16>(z), w = w ^ right<16>(w);
    x = x + y * w;
    y = y + z * x;
    z = z + x * y;
    return {x, y, z};
  }

  SCOLOPAX_SIMD static Int reverseBits(Int x) {
    // Bytes by a table of their halves, then the bytes themselves.
    const Int low = ints(0x0f0f0f0f);
    static constexpr std::int8_t kReversed[] = {0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15};
    return bytesReversed(left<4>(looked(kReversed, x & low)) | looked(kReversed, right<4>(x) & low));
  }
  SCOLOPAX_SIMD static Int owenScramble(Int reversed, Int seed) {
    Int x = reversed + (seed ^ right<16>(seed));
    x = x ^ x * word(0x6c50b47cu);
    x = x ^ x * word(0xb82f1e52u);
    x = x ^ x * word(0xc7afe638u);
    x = x ^ x * word(0x8d22f6e6u);
    return reverseBits(x);
  }

  Int pixels_;
  const kernel::SampleNumber& number_;
  std::uint32_t seed_;
  Int block_;
};

}  // namespace scolopax::SCOLOPAX_SIMD_SPACE
#endif
