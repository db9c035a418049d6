// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: a bijection of (pixel, sample, block, seed), so that no two draws share a
// state and none depends on threads, tiles or processes. The first blocks may be of low discrepancy. Integers
// only, until the last step.
#pragma once
#include <cstdint>

#include "renderer/kernel/lanes.h"

namespace scolopax::kernel {

/// Four words of 32 random bits.
template <class Word>
struct RandomBlockOf {
  Word x, y, z, w;
};
using RandomBlock = RandomBlockOf<std::uint32_t>;

/// pcg4d of Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020: a permutation of 128
/// bits.
template <class Word>
SCOLOPAX_LANES RandomBlockOf<Word> pcg4d(Word x, Word y, Word z, Word w) {
  x = x * 1664525u + 1013904223u;
  y = y * 1664525u + 1013904223u;
  z = z * 1664525u + 1013904223u;
  w = w * 1664525u + 1013904223u;
  x = x + y * w, y = y + z * x, z = z + x * y, w = w + y * z;
  x = x ^ right<16>(x), y = y ^ right<16>(y), z = z ^ right<16>(z), w = w ^ right<16>(w);
  x = x + y * w, y = y + z * x, z = z + x * y, w = w + y * z;
  return {x, y, z, w};
}

/// (k + 1/2) 2^-32, at most 1 - 2^-24: never 0 or 1, and fine enough near 0 that a free flight through
/// optical thickness 1e-7 still collides with the right probability.
template <class Word>
SCOLOPAX_LANES auto uniformOf(Word k) {
  return minimum((floatOfWord(k) + 0.5f) * 0x1p-32f, 0x1.fffffep-1f);
}

/// A bijection of 32 bits whose output bits all depend on all input bits (Wellons, "Prospecting for Hash
/// Functions", 2018: lowbias32).
template <class Word>
SCOLOPAX_LANES Word hashOf(Word x) {
  x = (x ^ right<16>(x)) * 0x7feb352du;
  x = (x ^ right<15>(x)) * 0x846ca68bu;
  return x ^ right<16>(x);
}

/// Number of leading blocks of a sampler whose words x, y, z come from a Sobol sequence.
inline constexpr std::uint32_t kLowDiscrepancyBlocks = 3;
/// Samplers of a sample with such blocks: the one that places and follows its ray, and that of aside().
inline constexpr std::uint32_t kLowDiscrepancySamplers = 2;
/// Samples of a pixel alternate between this many scramblings. The halves of a pixel's samples are thus
/// independent of each other, so that their difference tells the error of the picture.
inline constexpr std::uint32_t kScramblings = 2;

/// The part of a sample's random numbers that all pixels share (made by data/sampling.h).
struct SampleNumber {
  std::uint32_t sample;
  bool lowDiscrepancy;  ///< false: all draws are independent
  /// Point sample / kScramblings of the Sobol sequence, with the bits of each coordinate reversed. No two
  /// numbers of a sample use the same coordinate: scrambled differently, they would still depend on each
  /// other.
  std::uint32_t point[kLowDiscrepancySamplers * kLowDiscrepancyBlocks][3];
};

template <class Word>
SCOLOPAX_LANES Word reverseBits(Word x) {
  x = right<16>(x) | left<16>(x);
  x = left<8>(x & 0x00ff00ffu) | (right<8>(x) & 0x00ff00ffu);
  x = left<4>(x & 0x0f0f0f0fu) | (right<4>(x) & 0x0f0f0f0fu);
  x = left<2>(x & 0x33333333u) | (right<2>(x) & 0x33333333u);
  return left<1>(x & 0x55555555u) | (right<1>(x) & 0x55555555u);
}

/// Owen's nested uniform scrambling of a coordinate whose bits are reversed (Burley, "Practical Hash-based
/// Owen Scrambling", JCGT 9(4), 2020): every bit is flipped according to a hash of the bits before it.
template <class Word>
SCOLOPAX_LANES Word owenScramble(Word reversed, Word seed) {
  // The seed's lowest bit flips the coordinate's highest, and pcg4d's lowest bits are not random enough.
  Word x = reversed + (seed ^ right<16>(seed));
  x = x ^ x * 0x6c50b47cu;
  x = x ^ x * 0xb82f1e52u;
  x = x ^ x * 0xc7afe638u;
  x = x ^ x * 0x8d22f6e6u;
  return reverseBits(x);
}

/// Random numbers of one sample of one pixel per lane. Block 0 places the sample in the pixel. Every
/// tentative collision takes the next block: x gives its optical depth, y the channel, z acceptance.
template <class L>
class SamplerOf {
 public:
  using Word = typename L::Word;
  using Mask = typename L::Mask;
  using Block = RandomBlockOf<Word>;
  /// Borrows `number`.
  SCOLOPAX_LANES SamplerOf(Word pixel, const SampleNumber& number, std::uint32_t seed)
      : number_(number), pixel_(pixel), seed_(seed) {}
  SamplerOf(Word pixel, const SampleNumber&& number, std::uint32_t seed) = delete;
  /// Returns the next block. Lanes that are not in `which` do not advance, and their numbers are undefined.
  SCOLOPAX_LANES Block next(Mask which = L::everywhere()) {
    const Word block = block_;
    block_ = block_ + Word(onesOf(which));
    return at(block, which);
  }
  /// Returns any block, in any order. Numbers of lanes that are not in `which` are undefined.
  SCOLOPAX_LANES Block at(Word block, Mask which = L::everywhere()) const {
    const Mask low = Word(number_.lowDiscrepancy ? kLowDiscrepancyBlocks : 0u) > block;
    const Block random = pcg4d(pixel_, Word(number_.sample), block, Word(seed_));
    if (!any(low & which)) return random;
    // Samples stay below 2^31, so no other draw has this counter.
    const Word half(0x80000000u | (number_.sample % kScramblings));
    const Block scrambling = pcg4d(pixel_, half, block, Word(seed_));
    const Word row = (minimum(block, Word(kLowDiscrepancyBlocks - 1)) + Word(firstRow_)) * 3u;
    return {select(low, owenScramble(gather(&number_.point[0][0], row), scrambling.x), random.x),
            select(low, owenScramble(gather(&number_.point[0][1], row), scrambling.y), random.y),
            select(low, owenScramble(gather(&number_.point[0][2], row), scrambling.z), random.z),
            select(low, scrambling.w, random.w)};
  }
  /// Number of blocks that next() has returned.
  SCOLOPAX_LANES Word blocks() const { return block_; }
  SCOLOPAX_LANES void skipTo(Word block) { block_ = block; }
  /// A sampler with other numbers, independent of these, for a purpose whose draws must not change them.
  /// Pixels stay below 2^31.
  SCOLOPAX_LANES SamplerOf aside() const {
    SamplerOf other(pixel_ | Word(0x80000000u), number_, seed_);
    other.firstRow_ = kLowDiscrepancyBlocks;
    return other;
  }

 private:
  const SampleNumber& number_;
  Word pixel_;
  std::uint32_t seed_;
  std::uint32_t firstRow_ = 0;  // of SampleNumber::point
  Word block_{0u};
};
using Sampler = SamplerOf<One>;

}  // namespace scolopax::kernel
