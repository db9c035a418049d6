// SPDX-License-Identifier: Apache-2.0
#include "renderer/kernel/math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "renderer/kernel/rng.h"

namespace scolopax::kernel {
namespace {

/// Distance in units of the last place of the exact result.
double ulps(float found, double exact) {
  const float nearest = float(exact);
  const double ulp = double(std::nextafter(std::abs(nearest), kInfinity)) - double(std::abs(nearest));
  return std::abs(double(found) - exact) / ulp;
}

TEST(Math, OpticalDepthIsWithinTwoUlpOfMinusLogOneMinusU) {
  double worst = 0;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-33, 0);
  for (int i = 0; i < 2'000'000; ++i) {
    const float u = std::min(float(std::exp2(exponent(random))), 0x1.fffffep-1f);
    worst = std::max(worst, ulps(opticalDepth(u), -std::log1p(-double(u))));
  }
  for (std::uint32_t k = 0; k < (1u << 20); ++k) {  // the numbers next to 1
    const float u = 1.0f - float(k + 1) * 0x1p-24f;
    worst = std::max(worst, ulps(opticalDepth(u), -std::log1p(-double(u))));
  }
  EXPECT_LE(worst, 2.0);
}

TEST(Math, OpticalDepthIsFiniteAndPositiveAtBothEnds) {
  EXPECT_GT(opticalDepth(uniformOf(0u)), 0.0f);
  EXPECT_NEAR(opticalDepth(uniformOf(0xffffffffu)), 24 * std::log(2.0), 1e-5);
  EXPECT_LT(uniformOf(0xffffffffu), 1.0f);
  EXPECT_GT(uniformOf(0u), 0.0f);
}

TEST(Math, OpticalDepthFollowsTheExponentialLawAtThinMedia) {
  // P(depth < d) = 1 - exp(-d): counted over all values of u, so without noise. At d = 1e-6, values in steps
  // of 2^-24 would be wrong by 1.3 %, these by less than 2^-32 / d.
  for (const double d : {1e-7, 1e-6, 1e-5, 1e-3}) {
    std::uint32_t low = 0, high = 0xffffffffu;  // first k with opticalDepth >= d
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if (double(opticalDepth(uniformOf(middle))) < d)
        low = middle + 1;
      else
        high = middle;
    }
    const double probability = double(low) * 0x1p-32;
    EXPECT_NEAR(probability / -std::expm1(-d), 1, 0x1p-31 / d + 1e-6) << d;
  }
}

TEST(Math, PowerMatchesTheLibraryAndKeepsItsEnds) {
  for (const float g : {0.1f, 0.45f, 1.0f, 2.2f, 10.0f, 100.0f}) {
    EXPECT_EQ(power(0.0f, g), 0.0f);
    EXPECT_EQ(power(1.0f, g), 1.0f);
    float last = 0;
    for (int i = 1; i < 10000; ++i) {
      const float x = float(i) / 10000.0f;
      const double exact = std::pow(double(x), double(g));
      // The exponent's rounding error, at most 2^-24 * g * |log2 x| * 2, becomes a relative error.
      const double tolerance = 4e-7 + 2 * 0x1p-24 * double(g) * std::abs(std::log2(double(x)));
      if (exact > 1e-37) {
        EXPECT_NEAR(double(power(x, g)) / exact, 1, tolerance) << x << "^" << g;
      }
      EXPECT_GE(power(x, g), last * (1 - 4e-6f));
      last = std::max(last, power(x, g));
    }
  }
}

TEST(Math, ClampSendsNanToTheLowerEnd) {
  EXPECT_EQ(clamp(std::nanf(""), 2.0f, 3.0f), 2.0f);
  EXPECT_EQ(clamp(kInfinity, 2.0f, 3.0f), 3.0f);
  EXPECT_EQ(clamp(-kInfinity, 2.0f, 3.0f), 2.0f);
}

TEST(Rng, CountersThatDifferAnywhereGiveDifferentBlocks) {
  // pcg4d is a bijection. This checks inputs for which weaker schemes had collisions: small neighbouring
  // counters in every word.
  std::vector<std::array<std::uint32_t, 4>> seen;
  for (std::uint32_t pixel = 0; pixel < 24; ++pixel)
    for (std::uint32_t sample = 0; sample < 24; ++sample)
      for (std::uint32_t block = 0; block < 24; ++block)
        for (std::uint32_t seed = 0; seed < 8; ++seed) {
          const RandomBlock r = pcg4d(pixel, sample, block, seed);
          seen.push_back({r.x, r.y, r.z, r.w});
        }
  const std::size_t count = seen.size();
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::size_t(std::unique(seen.begin(), seen.end()) - seen.begin()), count);
}

TEST(Rng, WordsAreUniformAndUncorrelatedOverPixelsSamplesAndBlocks) {
  // 16 x 16 cells per pair of words. Chi-square with 255 degrees of freedom exceeds 347 with probability
  // 1e-4; there are 12 tables, and the seed is fixed.
  const int n = 1 << 20;
  for (int axis = 0; axis < 2; ++axis)
    for (int pair = 0; pair < 6; ++pair) {
      static constexpr int kPairs[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
      std::vector<int> counts(256);
      for (int i = 0; i < n; ++i) {
        const auto k = std::uint32_t(i);
        const RandomBlock r = axis == 0 ? pcg4d(k, 0u, 1u, 0u) : pcg4d(77u, k >> 3, k & 7, 5u);
        const std::uint32_t w[4] = {r.x, r.y, r.z, r.w};
        ++counts[(w[kPairs[pair][0]] >> 28) * 16 + (w[kPairs[pair][1]] >> 28)];
      }
      double chiSquare = 0;
      for (const int c : counts) chiSquare += std::pow(c - n / 256.0, 2) / (n / 256.0);
      EXPECT_LT(chiSquare, 347) << "axis " << axis << " pair " << pair;
    }
}

}  // namespace
}  // namespace scolopax::kernel
