// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/gradient_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <random>

#include "renderer/core/error.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

constexpr std::size_t kBins = GradientHistogram::kBins;

/// A grid whose axes have different lengths and are not perpendicular.
Grid tiltedGrid(glm::ivec3 dims) {
  Grid grid;
  grid.dims = dims;
  grid.worldFromVoxel[0] = {2, 0, 0, 0};
  grid.worldFromVoxel[1] = {1, 3, 0, 0};
  grid.worldFromVoxel[2] = {0, -1, 0.5, 0};
  grid.worldFromVoxel[3] = {10, 20, 30, 1};
  return grid;
}

std::uint64_t totalOf(const std::vector<std::uint64_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t(0));
}

TEST(GradientHistogram, OfALinearRampIsOneSteepnessUpToTheBorder) {
  // The data's gradient in world space is (4, -2, 6): 8, -2 and 5 per voxel along the voxel axes. The slope
  // of -2 reverses the stored values.
  const auto stored = [](int x, int y, int z) { return (8 * x - 2 * y + 5 * z) / -2.0; };
  const auto volume = volumeOf(tiltedGrid({5, 4, 3}), channelOf<float>({5, 4, 3}, stored, -2, 7));
  const GradientHistogram h = measureGradientHistogram(*volume, 0);
  EXPECT_NEAR(h.maximum, std::sqrt(16.0 + 4 + 36), 1e-12);  // rounding of the inverse matrix in double
  EXPECT_EQ(h.finiteCount, 60u);
  EXPECT_EQ(h.nonFiniteCount, 0u);
  std::vector<std::uint64_t> expected(kBins);
  expected.back() = 60;
  EXPECT_EQ(h.bins(), expected);
}

/// Values 0, 1, 4, 9 and 16, two world units apart: gradients of 1, 2, 4, 6 and 7 per voxel.
std::shared_ptr<const Volume> squares() {
  return volumeOf(gridOf({5, 1, 1}, {2, 5, 7}),
                  channelOf<std::uint8_t>({5, 1, 1}, [](int x, int, int) { return x * x; }));
}

TEST(GradientHistogram, TakesOneSidedDifferencesAtTheBorderAndNoneAlongAnAxisOfOneVoxel) {
  const GradientHistogram h = measureGradientHistogram(*squares(), 0);
  EXPECT_DOUBLE_EQ(h.maximum, 3.5);
  ASSERT_EQ(h.counts.size(), kBins * kBins);
  // Rows by value, at most 16; columns by gradient, at most 7.
  for (const auto& [value, slope] : {std::pair(0, 1), {1, 2}, {4, 4}, {9, 6}, {16, 7}}) {
    const std::size_t row = std::min<std::size_t>(std::size_t(value * 16), 255);
    const std::size_t column = std::min<std::size_t>(std::size_t(slope * 256 / 7), 255);
    EXPECT_EQ(h.counts[row * kBins + column], 1u) << value;
    EXPECT_EQ(h.stored[row].lo, float(value));
    EXPECT_EQ(h.stored[row].hi, float(value));
  }
  EXPECT_EQ(totalOf(h.counts), 5u);
  EXPECT_GT(h.stored[1].lo, h.stored[1].hi) << "no voxel has a value in the second bin";
}

TEST(GradientHistogram, LeavesOutWhatHasNoFiniteGradient) {
  const auto value = [](int x, int y, int z) {
    if (glm::ivec3(x, y, z) == glm::ivec3(2)) return std::numeric_limits<float>::quiet_NaN();
    if (glm::ivec3(x, y, z) == glm::ivec3(4)) return std::numeric_limits<float>::infinity();
    return float(x);
  };
  const auto volume = volumeOf(gridOf(glm::ivec3(5)), channelOf<float>(glm::ivec3(5), value));
  const GradientHistogram h = measureGradientHistogram(*volume, 0);
  // The voxel inside and its six neighbours; the one in the corner and its three.
  EXPECT_EQ(h.nonFiniteCount, 7u + 4u);
  EXPECT_EQ(h.finiteCount, 125u - 11u);
  EXPECT_EQ(totalOf(h.counts), h.finiteCount);
  EXPECT_DOUBLE_EQ(h.maximum, 1);
}

TEST(GradientHistogram, OfAFlatVolumeHasNothingAboveZero) {
  for (const glm::ivec3 dims : {glm::ivec3(1), glm::ivec3(1, 1, 6), glm::ivec3(4, 3, 2)}) {
    const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int) { return 3.0; }));
    const GradientHistogram h = measureGradientHistogram(*volume, 0);
    EXPECT_EQ(h.maximum, 0);
    EXPECT_EQ(h.bins()[0], volume->grid().voxelCount());
    EXPECT_EQ(gradientQuantile(h, volume->channels()[0], {}, 0.995), 0);
  }
}

TEST(GradientHistogram, OfVoxelsThatAreAllNotFiniteIsEmpty) {
  const auto nothing = [](int, int, int) { return std::numeric_limits<float>::quiet_NaN(); };
  const auto volume = volumeOf(gridOf({3, 2, 2}), channelOf<float>({3, 2, 2}, nothing));
  const GradientHistogram h = measureGradientHistogram(*volume, 0);
  EXPECT_EQ(h.finiteCount, 0u);
  EXPECT_EQ(h.nonFiniteCount, 12u);
  EXPECT_EQ(h.maximum, 0);
  EXPECT_EQ(gradientQuantile(h, volume->channels()[0], {}, 0.995), 0);
}

/// |gradient| of every voxel, by the reciprocal vectors of the voxels' axes.
std::vector<double> steepnesses(const Volume& volume, std::size_t channel) {
  const Channel& c = volume.channels()[channel];
  const auto voxels = c.voxels.as<std::uint16_t>();
  const glm::ivec3 dims = volume.grid().dims;
  const glm::dmat4& m = volume.grid().worldFromVoxel;
  const glm::dvec3 a(m[0]), b(m[1]), d(m[2]);
  const double box = glm::dot(a, glm::cross(b, d));
  const glm::dvec3 reciprocal[] = {glm::cross(b, d) / box, glm::cross(d, a) / box, glm::cross(a, b) / box};
  std::vector<double> found;
  for (int z = 0; z < dims.z; ++z)
    for (int y = 0; y < dims.y; ++y)
      for (int x = 0; x < dims.x; ++x) {
        glm::dvec3 gradient(0);
        for (int axis = 0; axis < 3; ++axis) {
          glm::ivec3 low(x, y, z), high(x, y, z);
          low[axis] = std::max(low[axis] - 1, 0);
          high[axis] = std::min(high[axis] + 1, dims[axis] - 1);
          const auto at = [&](glm::ivec3 p) {
            return c.slope * voxels[std::size_t((p.z * dims.y + p.y) * dims.x + p.x)] + c.intercept;
          };
          gradient += reciprocal[axis] * ((at(high) - at(low)) / (high[axis] - low[axis]));
        }
        found.push_back(glm::length(gradient));
      }
  return found;
}

TEST(GradientHistogram, AgreesWithAPlainLoopOverInterleavedChannels) {
  constexpr glm::ivec3 kDims{33, 20, 17};
  std::mt19937 random(1);
  const auto noise = [&](int, int, int) { return double(random() % 5000); };
  const auto volume = volumeOf(tiltedGrid(kDims), channelOf<std::uint16_t>(kDims, noise, 0.25, -3),
                               channelOf<std::uint16_t>(kDims, noise, -7));
  for (const int channel : {0, 1}) {
    const std::vector<double> expected = steepnesses(*volume, std::size_t(channel));
    const double maximum = *std::max_element(expected.begin(), expected.end());
    std::vector<std::uint64_t> bins(kBins);
    for (const double steepness : expected)
      ++bins[std::min(std::size_t(steepness / maximum * double(kBins)), kBins - 1)];
    const GradientHistogram h = measureGradientHistogram(*volume, channel);
    EXPECT_NEAR(h.maximum, maximum, 1e-12 * maximum);  // the sums in double have different orders
    EXPECT_EQ(h.bins(), bins);
    // Summed over gradients, it is the channel's own histogram.
    std::vector<std::uint64_t> values(kBins);
    for (std::size_t i = 0; i < h.counts.size(); ++i) values[i / kBins] += h.counts[i];
    EXPECT_EQ(values, volume->channels()[std::size_t(channel)].histogram.bins);
  }
}

/// Quantile of the gradients of squares() under a curve over [lo, hi].
double quantileOfSquares(double lo, double hi, double p,
                         std::vector<OpacityKnot> opacity = {{0, 0}, {1, 1}}) {
  const auto volume = squares();
  ChannelAppearance look;
  look.rangeLo = lo;
  look.rangeHi = hi;
  look.opacity = std::move(opacity);
  look.density = 0;                              // has no effect
  look.gradientOpacity = GradientOpacity{5, 6};  // nor has this
  return gradientQuantile(measureGradientHistogram(*volume, 0), volume->channels()[0], look, p);
}

/// The gradient at `share` of the bin that holds `perVoxel`; the largest, 7 per voxel, is 3.5 per world unit.
double inBinOf(int perVoxel, double share) { return (std::min(perVoxel * 256 / 7, 255) + share) / 256 * 3.5; }

TEST(GradientQuantile, IsOfTheVoxelsThatHaveOpacity) {
  // 9 and 16 have opacity; 4 has none.
  EXPECT_DOUBLE_EQ(quantileOfSquares(4, 16, 0.25), inBinOf(6, 0.5));
  EXPECT_DOUBLE_EQ(quantileOfSquares(4, 16, 0.5), inBinOf(6, 1));
  EXPECT_DOUBLE_EQ(quantileOfSquares(4, 16, 0.75), inBinOf(7, 0.5));
  EXPECT_DOUBLE_EQ(quantileOfSquares(4, 16, 1), 3.5);
  // A reversed range: 0, 1 and 4 have opacity; 9 has none.
  EXPECT_DOUBLE_EQ(quantileOfSquares(9, 0, 1), inBinOf(4, 1));
  // A window that contains only 4.
  EXPECT_DOUBLE_EQ(quantileOfSquares(3, 5, 1, {{0, 0}, {0.5, 1}, {1, 0}}), inBinOf(4, 1));
}

TEST(GradientQuantile, IsOfAllVoxelsWhereNoneHasOpacity) {
  EXPECT_DOUBLE_EQ(quantileOfSquares(0, 16, 0.2, {{0, 0}}), inBinOf(1, 1));
  EXPECT_DOUBLE_EQ(quantileOfSquares(20, 30, 1), 3.5);
}

TEST(GradientQuantile, TakesBinsThatHaveOpacityInPartOnlyWhereNoneHasItAtBothEnds) {
  // 0.4 and 0.6 share a bin of values, and only values between them have opacity.
  constexpr double kValues[] = {0, 0.4, 0.6, 100};
  const auto volume =
      volumeOf(gridOf({4, 1, 1}), channelOf<float>({4, 1, 1}, [&](int x, int, int) { return kValues[x]; }));
  const GradientHistogram h = measureGradientHistogram(*volume, 0);
  const Channel& channel = volume->channels()[0];
  ASSERT_EQ(channel.histogram.binOf(0.4), channel.histogram.binOf(0.6));
  ChannelAppearance look;
  look.rangeLo = 0.4;
  look.rangeHi = 0.6;
  look.opacity = {{0, 0}, {0.5, 1}, {1, 0}};
  // The larger gradient of the two is half of 99.6; the largest of all voxels is 99.4.
  EXPECT_NEAR(gradientQuantile(h, channel, look, 1), 129.0 / 256 * 99.4, 1e-4);  // voxels are floats
  look.rangeHi = 100;
  look.opacity = {{0, 0}, {0.001, 1}, {0.9, 0}, {1, 1}};
  // 100 and 0.6 have opacity, 0.4 has none.
  EXPECT_NEAR(gradientQuantile(h, channel, look, 0.5), 255.5 / 256 * 99.4, 1e-4);
}

TEST(GradientHistogram, IsNotMeasuredToTheEndWhenNobodyWantsIt) {
  const auto volume = squares();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(measureGradientHistogram(*volume, 0, stop.get_token()), Error);
  EXPECT_THROW(sharedGradientHistogram(volume, 0, stop.get_token()), Error);
}

TEST(GradientHistogram, IsSharedByVolumeAndChannelWhileItIsHeld) {
  const auto ramp = [](int x, int, int) { return x; };
  const auto make = [&] {
    return volumeOf(gridOf({9, 2, 2}), channelOf<std::uint8_t>({9, 2, 2}, ramp),
                    channelOf<std::uint8_t>({9, 2, 2}, ramp));
  };
  const auto volume = make(), other = make();
  const auto memory = std::make_shared<MemoryBudget>(std::uint64_t(1) << 30);
  {
    const auto first = sharedGradientHistogram(volume, 0, {}, memory);
    EXPECT_EQ(memory->used(MemoryUse::grids), first->sizeBytes());
    EXPECT_EQ(sharedGradientHistogram(volume, 0, {}, memory), first);
    const auto second = sharedGradientHistogram(volume, 1, {}, memory);
    EXPECT_NE(second, first);
    EXPECT_NE(sharedGradientHistogram(other, 0, {}, memory), first);
    EXPECT_EQ(memory->used(MemoryUse::grids), 2 * first->sizeBytes());
  }
  EXPECT_EQ(memory->used(MemoryUse::grids), 0u);
  try {
    sharedGradientHistogram(volume, 0, {}, std::make_shared<MemoryBudget>(1000));
    FAIL() << "was not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::tooLarge);
  }
}

}  // namespace
}  // namespace scolopax
