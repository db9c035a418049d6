// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/sampling.h"

#include <array>
#include <iterator>

namespace scolopax {
namespace {

/// A primitive polynomial over GF(2), inner coefficients as bits, and the first odd numbers m_i.
struct Polynomial {
  int degree;
  std::uint32_t inner;
  std::uint32_t m[6];
};
constexpr Polynomial kPolynomials[] = {{1, 0, {1}},
                                       {2, 1, {1, 3}},
                                       {3, 1, {1, 3, 1}},
                                       {3, 2, {1, 1, 1}},
                                       {4, 1, {1, 1, 3, 3}},
                                       {4, 4, {1, 3, 5, 13}},
                                       {5, 2, {1, 1, 5, 5, 17}},
                                       {5, 4, {1, 1, 5, 5, 5}},
                                       {5, 7, {1, 1, 7, 11, 19}},
                                       {5, 11, {1, 1, 5, 1, 1}},
                                       {5, 13, {1, 1, 1, 3, 11}},
                                       {5, 14, {1, 3, 5, 5, 31}},
                                       {6, 1, {1, 3, 3, 9, 7, 49}},
                                       {6, 13, {1, 1, 1, 15, 21, 21}},
                                       {6, 16, {1, 3, 1, 13, 27, 49}},
                                       {6, 19, {1, 1, 1, 15, 7, 5}},
                                       {6, 22, {1, 3, 1, 15, 13, 25}}};
static_assert(std::size(kPolynomials) + 1 == kSobolDimensions);

/// What bit k of the index contributes to each coordinate, by exclusive or.
using Columns = std::array<std::array<std::uint32_t, 32>, kSobolDimensions>;
constexpr Columns kColumns = [] {
  Columns columns{};
  for (int k = 0; k < 32; ++k) columns[0][std::size_t(k)] = 1u << (31 - k);
  for (int d = 1; d < kSobolDimensions; ++d) {
    const Polynomial& p = kPolynomials[d - 1];
    auto& column = columns[std::size_t(d)];
    for (int k = 0; k < 32; ++k) {
      std::uint32_t& v = column[std::size_t(k)];
      if (k < p.degree) {
        v = p.m[k] << (31 - k);
        continue;
      }
      v = column[std::size_t(k - p.degree)] ^ (column[std::size_t(k - p.degree)] >> p.degree);
      for (int j = 1; j < p.degree; ++j)
        if ((p.inner >> (p.degree - 1 - j)) & 1) v ^= column[std::size_t(k - j)];
    }
  }
  return columns;
}();

/// The dimensions of the sequence for the words of each block. The best ones go where most depends on them:
/// to the position in the pixel, then to the first collision. The other sampler's words are the points
/// and jitters of lit strata.
constexpr int kDimensions[][3] = {{0, 1, 8}, {2, 3, 4}, {5, 6, 7}, {9, 10, 11}, {12, 13, 14}, {15, 16, 17}};
static_assert(3 * std::size(kDimensions) == kSobolDimensions);

}  // namespace

std::uint32_t sobol(int dimension, std::uint32_t index) {
  std::uint32_t coordinate = 0;
  for (std::size_t k = 0; index != 0; index >>= 1, ++k)
    if (index & 1) coordinate ^= kColumns[std::size_t(dimension)][k];
  return coordinate;
}

kernel::SampleNumber sampleNumber(Sampling sampling, std::uint32_t sample) {
  kernel::SampleNumber number{sample, sampling == Sampling::lowDiscrepancy, {}};
  for (std::size_t block = 0; block < std::size(kDimensions); ++block)
    for (int i = 0; i < 3; ++i)
      number.point[block][i] =
          kernel::reverseBits(sobol(kDimensions[block][i], sample / kernel::kScramblings));
  return number;
}

}  // namespace scolopax
