// SPDX-License-Identifier: Apache-2.0
// Random numbers by counting: a bijection of (pixel, sample, block, seed), so that no two draws share a
// state and none depends on threads, tiles or processes. Integer only until the last step.
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

/// The draws of one sample of one pixel. Block 0 places the sample in the pixel; every tentative collision
/// takes the next block: x its optical depth, y the channel, z acceptance.
class Sampler {
 public:
  SCOLOPAX_HD Sampler(std::uint32_t pixel, std::uint32_t sample, std::uint32_t seed)
      : pixel_(pixel), sample_(sample), seed_(seed) {}
  SCOLOPAX_HD RandomBlock next() { return pcg4d(pixel_, sample_, block_++, seed_); }
  SCOLOPAX_HD std::uint32_t blocks() const { return block_; }

 private:
  std::uint32_t pixel_, sample_, seed_;
  std::uint32_t block_ = 0;
};

}  // namespace scolopax::kernel
