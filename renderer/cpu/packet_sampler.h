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

/// kernel::Sampler, for blocks of which two words are wanted.
class PacketSampler {
 public:
  struct Block {
    Int x, y;
  };
  SCOLOPAX_AVX2 PacketSampler(Int pixels, const kernel::SampleNumber& number, std::uint32_t seed)
      : pixels_(pixels), number_(number), seed_(seed) {}

  SCOLOPAX_AVX2 Block next() {
    const std::uint32_t block = block_++;
    if (!number_.lowDiscrepancy || block >= kernel::kLowDiscrepancyBlocks)
      return pcg4d(number_.sample, block);
    const std::uint32_t replicate = 0x80000000u | (number_.sample / kernel::kReplicateSamples);
    const Block scrambling = pcg4d(replicate, block);
    const std::uint32_t* point = number_.point[block];
    return {owenScramble(point[0], scrambling.x), owenScramble(point[1], scrambling.y)};
  }
  SCOLOPAX_AVX2 std::uint32_t blocks() const { return block_; }

 private:
  SCOLOPAX_AVX2 static Int word(std::uint32_t k) { return ints(int(k)); }

  SCOLOPAX_AVX2 Block pcg4d(std::uint32_t sample, std::uint32_t block) const {
    const Int factor = word(1664525u), term = word(1013904223u);
    Int x = pixels_ * factor + term;
    Int y = word(sample * 1664525u + 1013904223u);
    Int z = word(block * 1664525u + 1013904223u);
    Int w = word(seed_ * 1664525u + 1013904223u);
    x = x + y * w, y = y + z * x, z = z + x * y, w = w + y * z;
    x = x ^ right<16>(x), y = y ^ right<16>(y), z = z ^ right<16>(z), w = w ^ right<16>(w);
    x = x + y * w;
    y = y + z * x;
    return {x, y};
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
  SCOLOPAX_AVX2 static Int owenScramble(std::uint32_t reversed, Int seed) {
    Int x = word(reversed) + (seed ^ right<16>(seed));
    x = x ^ x * word(0x6c50b47cu);
    x = x ^ x * word(0xb82f1e52u);
    x = x ^ x * word(0xc7afe638u);
    x = x ^ x * word(0x8d22f6e6u);
    return reverseBits(x);
  }

  Int pixels_;
  const kernel::SampleNumber& number_;
  std::uint32_t seed_, block_ = 0;
};

}  // namespace scolopax::lanes
#endif
