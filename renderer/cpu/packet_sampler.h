// SPDX-License-Identifier: Apache-2.0
// The random numbers of eight pixels at once: kernel/rng.h, which says what they are and where they are from.
#pragma once
#include "renderer/cpu/lanes.h"
#include "renderer/kernel/rng.h"
#if defined(__x86_64__)

namespace scolopax::lanes {

/// kernel::uniformOf.
SCOLOPAX_AVX2 Float uniformOf(Int k) {
  // Both halves are exact, so that their sum is rounded as the number itself would be.
  const Float whole = toFloat(right<16>(k)) * floats(65536.0f) + toFloat(k & ints(0xffff));
  return minimum((whole + floats(0.5f)) * floats(0x1p-32f), floats(0x1.fffffep-1f));
}

/// kernel::Sampler, for blocks of which the first three words are wanted; every pixel at a block of its own.
class PacketSampler {
 public:
  struct Block {
    Int x, y, z;
  };
  SCOLOPAX_AVX2 PacketSampler(Int pixels, const kernel::SampleNumber& number, std::uint32_t seed)
      : pixels_(pixels), number_(number), seed_(seed), block_(ints(0)) {}

  /// The others stay where they are, and get anything.
  SCOLOPAX_AVX2 Block next(Mask which) {
    const Int block = block_;
    block_ = block_ + onesOf(which);
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
  SCOLOPAX_AVX2 Int blocks() const { return block_; }
  /// kernel::Sampler::aside.
  SCOLOPAX_AVX2 PacketSampler aside() const {
    return PacketSampler(pixels_ | word(0x80000000u), number_, seed_);
  }

 private:
  SCOLOPAX_AVX2 static Int word(std::uint32_t k) { return ints(int(k)); }
  SCOLOPAX_AVX2 Int point(Int row, int column) const {
    return {_mm256_i32gather_epi32(reinterpret_cast<const int*>(&number_.point[0][column]), row.v, 4)};
  }

  SCOLOPAX_AVX2 Block pcg4d(Int sample, Int block) const {
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

  SCOLOPAX_AVX2 static Int reverseBits(Int x) {
    // Bytes by a table of their halves, then the bytes themselves.
    const Int low = ints(0x0f0f0f0f);
    const __m256i reversed =
        _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15));
    const Int lower{_mm256_shuffle_epi8(reversed, (x & low).v)};
    const Int upper{_mm256_shuffle_epi8(reversed, (right<4>(x) & low).v)};
    const __m256i order =
        _mm256_broadcastsi128_si256(_mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12));
    return {_mm256_shuffle_epi8((left<4>(lower) | upper).v, order)};
  }
  SCOLOPAX_AVX2 static Int owenScramble(Int reversed, Int seed) {
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

}  // namespace scolopax::lanes
#endif
