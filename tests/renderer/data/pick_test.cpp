// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/pick.h"

#include <gtest/gtest.h>

#include <set>

namespace scolopax {
namespace {

using kernel::FirstCollision;

std::vector<FirstCollision> samplesOf(std::size_t through, std::vector<FirstCollision> ends) {
  ends.resize(ends.size() + through);
  return ends;
}

TEST(VisibleSample, IsTheMedianOfTheChannelInWhichMostEnd) {
  EXPECT_EQ(visibleSample(samplesOf(0, {{9, 1}, {2, 0}, {7, 1}, {1, 0}, {8, 1}})), 4u);
  // The nearer of two median samples, and the first of the channels with equally many samples.
  EXPECT_EQ(visibleSample(samplesOf(3, {{9, 1}, {4, 0}, {3, 0}, {8, 1}})), 2u);
  EXPECT_EQ(visibleSample(samplesOf(0, {{5, 2}, {5, 2}, {5, 2}})), 1u);
}

TEST(VisibleSample, NeedsOneInSixteen) {
  EXPECT_EQ(visibleSample(samplesOf(15, {{1, 0}})), 0u);
  EXPECT_EQ(visibleSample(samplesOf(16, {{1, 0}})), std::nullopt);
  EXPECT_EQ(visibleSample(samplesOf(30, {{1, 0}, {1, 1}})), 0u);
  EXPECT_EQ(visibleSample(samplesOf(64, {})), std::nullopt);
  EXPECT_EQ(visibleSample({}), std::nullopt);
}

TEST(PixelsToPick, AreAllOfASmallArea) {
  const auto pixels = pixelsToPick({3, 5, 2, 2});
  EXPECT_EQ(pixels, (std::vector<glm::ivec2>{{3, 5}, {4, 5}, {3, 6}, {4, 6}}));
  for (const auto& [width, height] : {std::pair{32, 32}, {1024, 1}, {1, 1024}, {2, 512}, {341, 3}}) {
    std::set<std::pair<int, int>> all;
    for (const glm::ivec2 p : pixelsToPick({7, 9, width, height})) {
      all.emplace(p.x, p.y);
      EXPECT_TRUE(p.x >= 7 && p.x < 7 + width && p.y >= 9 && p.y < 9 + height);
    }
    EXPECT_EQ(all.size(), std::size_t(width) * std::size_t(height));
  }
}

TEST(PixelsToPick, AreARegularLatticeOfALargeArea) {
  for (const auto& [width, height] :
       {std::pair{16384, 16384}, {1025, 1}, {1, 16384}, {33, 32}, {16384, 2}, {640, 480}}) {
    const auto pixels = pixelsToPick({10, 20, width, height});
    std::set<int> columns, rows;
    for (const glm::ivec2 p : pixels) columns.insert(p.x), rows.insert(p.y);
    EXPECT_EQ(columns.size() * rows.size(), pixels.size());
    EXPECT_LE(pixels.size(), std::size_t(kMaxPickPixels));
    EXPECT_GT(pixels.size(), std::size_t(kMaxPickPixels) * 9 / 10) << width << "x" << height;
    // No gap between sampled places is longer than two cells of the lattice.
    const auto spread = [](const std::set<int>& places, int first, int length) {
      int before = first - 1, largest = 0;
      for (const int place : places) largest = std::max(largest, place - before), before = place;
      largest = std::max(largest, first + length - before);
      return double(largest) * double(places.size()) / length;
    };
    EXPECT_LE(spread(columns, 10, width), 2) << width << "x" << height;
    EXPECT_LE(spread(rows, 20, height), 2) << width << "x" << height;
  }
}

TEST(PickSamples, AreFewerForMorePixelsAndNeverMoreThan4096InAll) {
  EXPECT_EQ(pickSamplesSide(1), 8);
  EXPECT_EQ(pickSamplesSide(64), 8);
  EXPECT_EQ(pickSamplesSide(65), 4);
  EXPECT_EQ(pickSamplesSide(256), 4);
  EXPECT_EQ(pickSamplesSide(257), 2);
  EXPECT_EQ(pickSamplesSide(1024), 2);
}

}  // namespace
}  // namespace scolopax
