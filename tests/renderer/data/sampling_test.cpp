// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

namespace scolopax {
namespace {

using kernel::kScramblings;
using kernel::RandomBlock;
using kernel::Sampler;

constexpr std::size_t kWords = kSobolDimensions;

/// The words of the first blocks of one sample of one pixel, and of its sampler aside().
std::vector<std::uint32_t> words(std::uint32_t pixel, std::uint32_t sample, std::uint32_t seed = 7) {
  const kernel::SampleNumber number = sampleNumber(Sampling::lowDiscrepancy, sample);
  const Sampler sampler(pixel, number, seed);
  std::vector<std::uint32_t> all;
  for (const Sampler& each : {sampler, sampler.aside()})
    for (std::uint32_t block = 0; block < kernel::kLowDiscrepancyBlocks; ++block) {
      const RandomBlock random = each.at(block);
      all.insert(all.end(), {random.x, random.y, random.z});
    }
  return all;
}

TEST(Sobol, BeginsAsPublished) {
  // The first points in two dimensions, as in the literature on the sequence.
  const double expected[8][2] = {{0, 0},         {0.5, 0.5},     {0.25, 0.75},   {0.75, 0.25},
                                 {0.125, 0.625}, {0.625, 0.125}, {0.375, 0.375}, {0.875, 0.875}};
  for (std::uint32_t i = 0; i < 8; ++i)
    for (int d = 0; d < 2; ++d) EXPECT_EQ(double(sobol(d, i)) * 0x1p-32, expected[i][d]) << i << " " << d;
}

TEST(Sobol, EveryCoordinateVisitsEveryInterval) {
  // Of the first 2^m points, one lies in each of the 2^m intervals of a coordinate. This fails for any
  // invalid m_i or polynomial.
  for (int d = 0; d < kSobolDimensions; ++d)
    for (const std::uint32_t m : {1u, 4u, 10u}) {
      std::vector<int> counts(1u << m);
      for (std::uint32_t i = 0; i < 1u << m; ++i) ++counts[sobol(d, i) >> (32 - m)];
      EXPECT_EQ(std::count(counts.begin(), counts.end(), 1), 1 << m) << "dimension " << d << " m " << m;
    }
}

TEST(Sobol, CoordinatesAreNotCopiesOfEachOther) {
  // Two dimensions with the same polynomial or m_i would lie on a line; these fill all cells of 1/16.
  for (int a = 0; a < kSobolDimensions; ++a)
    for (int b = 0; b < a; ++b) {
      std::map<std::uint32_t, int> cells;
      for (std::uint32_t i = 0; i < 4096; ++i) ++cells[(sobol(a, i) >> 28) * 16 + (sobol(b, i) >> 28)];
      EXPECT_EQ(cells.size(), 256u) << a << " and " << b;
    }
}

TEST(Sampling, SpreadsEveryWordOfEachHalfEvenly) {
  // The even samples, and the odd ones: of any 64 that follow each other from a multiple of 64 on, one lies
  // in each of the 64 intervals of every word.
  for (const std::uint32_t pixel : {0u, 1u, 99999u})
    for (const std::uint32_t half : {0u, 1u})
      for (const std::uint32_t first : {0u, 64u, 320000u}) {
        std::vector<std::vector<int>> counts(kWords, std::vector<int>(64));
        std::vector<int> places(64);
        for (std::uint32_t i = 0; i < 64; ++i) {
          const auto w = words(pixel, kScramblings * (first + i) + half);
          for (std::size_t d = 0; d < w.size(); ++d) ++counts[d][w[d] >> 26];
          ++places[(w[0] >> 29) * 8 + (w[1] >> 29)];
        }
        for (const auto& one : counts) EXPECT_EQ(std::count(one.begin(), one.end(), 1), 64);
        // Positions in the pixel: one sample in every cell of 1/8 x 1/8.
        EXPECT_EQ(std::count(places.begin(), places.end(), 1), 64);
      }
}

TEST(Sampling, GoesOnToSpreadEvenlyAsSamplesGrow) {
  std::vector<std::vector<int>> counts(kWords, std::vector<int>(4096));
  for (std::uint32_t i = 0; i < 4096; ++i) {
    const auto w = words(7, kScramblings * i);
    for (std::size_t d = 0; d < w.size(); ++d) ++counts[d][w[d] >> 20];
  }
  for (const auto& one : counts) EXPECT_EQ(std::count(one.begin(), one.end(), 1), 4096);
}

TEST(Sampling, LeavesEverySampleUniform) {
  // Over pixels, and over seeds of one pixel, the word of a fixed sample is uniform; this makes the estimator
  // unbiased. Chi-square with 255 degrees of freedom exceeds 347 with probability 1e-4; 72 tables.
  for (const std::uint32_t sample : {0u, 37u})
    for (const bool overPixels : {true, false}) {
      std::vector<std::vector<int>> counts(kWords, std::vector<int>(256));
      constexpr int kDraws = 1 << 15;
      for (std::uint32_t i = 0; i < kDraws; ++i) {
        const auto w = overPixels ? words(i, sample) : words(3, sample, i);
        for (std::size_t d = 0; d < w.size(); ++d) ++counts[d][w[d] >> 24];
      }
      for (const auto& one : counts) {
        double chiSquare = 0;
        for (const int c : one) chiSquare += std::pow(c - kDraws / 256.0, 2) / (kDraws / 256.0);
        EXPECT_LT(chiSquare, 347) << "sample " << sample << (overPixels ? " over pixels" : " over seeds");
      }
    }
}

/// Correlation of two lists of words; for independent uniform ones its standard deviation is 1/sqrt(size).
double correlation(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += 12 * (double(a[i]) * 0x1p-32 - 0.5) * (double(b[i]) * 0x1p-32 - 0.5);
  return sum / double(a.size());
}

TEST(Sampling, IsIndependentBetweenPixelsHalvesSeedsAndWords) {
  constexpr std::uint32_t kDraws = 1 << 14;
  const double limit = 5.0 / std::sqrt(double(kDraws));  // 5 sigma: 6e-7 each, 72 comparisons
  for (std::size_t d = 0; d < kWords; ++d) {
    std::vector<std::uint32_t> here, right, otherHalf, otherSeed, otherWord;
    for (std::uint32_t i = 0; i < kDraws; ++i) {
      here.push_back(words(2 * i, 5)[d]);
      right.push_back(words(2 * i + 1, 5)[d]);
      otherHalf.push_back(words(2 * i, 4)[d]);
      otherSeed.push_back(words(2 * i, 5, 8)[d]);
      otherWord.push_back(words(2 * i, 5)[(d + 1) % kWords]);
    }
    EXPECT_LT(std::abs(correlation(here, right)), limit) << "word " << d;
    EXPECT_LT(std::abs(correlation(here, otherHalf)), limit) << "word " << d;
    EXPECT_LT(std::abs(correlation(here, otherSeed)), limit) << "word " << d;
    EXPECT_LT(std::abs(correlation(here, otherWord)), limit) << "word " << d;
  }
}

TEST(Sampling, LetsNoWordDependOnAnother) {
  // Two words that are scramblings of one coordinate fill only some of the cells, however many samples there
  // are, so that a picture of both would converge to a wrong one.
  for (const std::uint32_t pixel : {0u, 99999u})
    for (const std::uint32_t seed : {7u, 8u}) {
      std::vector<std::vector<std::uint32_t>> draws;
      for (std::uint32_t i = 0; i < 4096; ++i) draws.push_back(words(pixel, kScramblings * i, seed));
      for (std::size_t a = 0; a < kWords; ++a)
        for (std::size_t b = 0; b < a; ++b) {
          std::map<std::uint32_t, int> cells;
          for (const auto& w : draws) ++cells[(w[a] >> 29) * 8 + (w[b] >> 29)];
          EXPECT_EQ(cells.size(), 64u) << a << " and " << b << ", pixel " << pixel;
        }
    }
}

TEST(Sampling, OfIndependentDrawsIsPlainCounting) {
  const kernel::SampleNumber number = sampleNumber(Sampling::independent, 70);
  Sampler sampler(11, number, 3);
  for (std::uint32_t block = 0; block < 5; ++block) {
    const RandomBlock found = sampler.next(), expected = kernel::pcg4d(11u, 70u, block, 3u);
    EXPECT_EQ(found.x, expected.x);
    EXPECT_EQ(found.w, expected.w);
  }
}

}  // namespace
}  // namespace scolopax
