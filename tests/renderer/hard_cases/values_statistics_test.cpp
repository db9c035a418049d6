// SPDX-License-Identifier: Apache-2.0
// Voxel values and ranges that lose precision or meaning, in the trackers and the reference.
#include <gtest/gtest.h>

#include "tests/renderer/hard_cases/hard_scenes.h"

namespace scolopax {
namespace {

using namespace test;

/// Compares one channel of values f(i,j,k), seen from the side over [lo, hi], with the reference.
template <class T, class F>
void expectRangeMatches(F&& value, double lo, double hi, double slope = 1, double intercept = 0) {
  const auto volume = volumeOf(gridOf(kSmallDims), channelOf<T>(kSmallDims, value, slope, intercept));
  Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, kSide);
  scene.channels = {ramp(lo, hi, 0.5)};
  scene.channels[0].color = {{0, kRed}, {0.4, kRed}, {0.4, kGreen}, {1, kGreen}};
  expectReference(volume, scene, kSamples);
}

/// A lumpy field between lo and hi.
auto between(double lo, double hi) {
  return [=](int x, int y, int z) { return lo + (hi - lo) * lumps(1)(x, y, z); };
}

TEST(VoxelValues, OfAConstantVolumeAreSeenAtTheirPlaceOnTheCurve) {
  for (const double value : {0.0, 0.3, 1.0}) {
    const auto volume =
        volumeOf(gridOf(kSmallDims), channelOf<float>(kSmallDims, [&](int, int, int) { return value; }));
    Scene scene = frontScene(*volume, 16, 16);
    scene.camera.orthoHeight = 5;  // inside the silhouette
    scene.channels[0] = ramp(0, 1, 0.4, kRed);
    const double alpha = -std::expm1(-0.4 * double(float(value)) * 5);
    expectTrackersMatch(flat(scene, {alpha, 0, 0, alpha}), volume, scene, 300);
  }
}

TEST(VoxelValues, ThatAreNotFiniteLeaveHolesOfTheirCells) {
  for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY)}) {
    const auto holed = [&](int x, int y, int z) {
      return (x == 3 && y == 2) || (x == 0 && y == 5 && z == 4) ? bad : lumps()(x, y, z);
    };
    const auto volume = volumeOf(gridOf(kSmallDims), channelOf<float>(kSmallDims, holed),
                                 channelOf<float>(kSmallDims, lumps(2)));
    Scene scene = viewFrom(*volume, {15, 11, -8}, {3, 2.5, 2}, 32, kSide);
    scene.channels = {ramp(0, 1, 0.5, kRed), ramp(0, 1, 0.3, kBlue)};
    for (const int macrocell : {1, 4}) {
      scene.macrocell = macrocell;
      expectReference(volume, scene, kSamples);
    }
  }
}

TEST(VoxelValues, OfEveryKindAtOnceMatchTheReference) {
  const float kinds[] = {NAN,
                         INFINITY,
                         -INFINITY,
                         float(kLargest),
                         -float(kLargest),
                         float(kDenormal),
                         -0.0f,
                         0.0f,
                         -float(kDenormal),
                         1e-30f,
                         1.0f,
                         -1e20f};
  std::uint32_t state = 5;
  const auto value = [&](int, int, int) {
    state = state * 1664525u + 1013904223u;
    return (state >> 20) % 4 ? float(state >> 8) * 0x1p-24f : kinds[(state >> 24) % 12];
  };
  const auto volume = volumeOf(gridOf({12, 12, 12}), channelOf<float>({12, 12, 12}, value));
  Scene scene = viewFrom(*volume, {28, 20, -14}, {5.5, 5.5, 5.5}, 32, kSide);
  for (const auto& [lo, hi] :
       {std::pair(0.0, 1.0), std::pair(-kLargest, kLargest), std::pair(-1e-38, 1e-38)}) {
    scene.channels = {ramp(lo, hi, 0.3, kGreen)};
    expectReference(volume, scene, kSamples);
  }
}

TEST(VoxelValues, OfDenormalsAndOfTheLargestFloatsAreAsGoodAsOthers) {
  expectRangeMatches<float>(between(0, 1000 * kDenormal), 0, 1000 * kDenormal);
  expectRangeMatches<float>(between(-kLargest, kLargest), -kLargest, kLargest);
  expectRangeMatches<float>(between(-1e-38, 1e-38), -0.5e-38, 1e-38);
}

TEST(VoxelValues, OfTemperaturesMatchTheReferenceOverTheirRangeAndATenthOfADegree) {
  expectRangeMatches<float>(between(280, 310), 280, 310);
  expectRangeMatches<float>(between(280, 310), 300, 290);
  expectRangeMatches<float>(between(299.95, 300.05), 299.98, 300.02);
}

TEST(VoxelValues, OfATinySpreadFarFromZeroMatchTheReference) {
  const auto steps = [](int x, int y, int z) { return 1e6 + 0.0625 * std::round(16 * lumps()(x, y, z)); };
  expectRangeMatches<float>(steps, 1e6, 1e6 + 1);
  expectRangeMatches<float>(steps, 1e6 + 0.3, 1e6 + 0.7);
}

TEST(VoxelValues, OfTheFullRangeOfIntegersMatchTheReference) {
  expectRangeMatches<std::uint8_t>(between(0, 255), 0, 255);
  expectRangeMatches<std::uint16_t>(between(0, 65535), 0, 65535);
  expectRangeMatches<std::int16_t>(between(-32768, 32767), -32768, 32767);
  expectRangeMatches<std::int16_t>(between(-32768, 32767), 273.15, 310, -0.01, 300);
}

TEST(VoxelValues, BelowAndAboveAnEmptyRangeAreSeparatedAtIt) {
  // The optical thickness is that of the part of a ramp at or above the value, for either sign of the slope.
  const int n = 9;
  const glm::ivec3 dims(2, 2, n);
  const auto up = [](int, int, int z) { return z; };
  const auto down = [](int, int, int z) { return -2 * z; };
  for (const auto& volume : {volumeOf(gridOf(dims), channelOf<float>(dims, up)),
                             volumeOf(gridOf(dims), channelOf<std::int16_t>(dims, down, -0.5, 0))}) {
    Scene scene = frontScene(*volume, 16, 16);
    scene.channels[0] = ramp(2.25, 2.25, 0.2, kRed);
    expectThickness(volume, scene, 0.2 * (8.5 - 2.25), kRed, 300);
    scene.channels[0] = ramp(8, 8, 2, kRed);  // the last value only: the outer half voxel
    expectThickness(volume, scene, 2 * 0.5, kRed, 300);
    scene.channels[0] = ramp(0, 0, 0.2, kRed);  // everything
    expectThickness(volume, scene, 0.2 * 9, kRed, 300);
    scene.channels[0] = ramp(8.001, 8.001, 1e6, kRed);  // nothing
    expectTrackersMatch(flat(scene, glm::dvec4(0)), volume, scene, 4);
  }
}

TEST(VoxelValues, OverReversedRangesAndRangesWithoutZeroAndOneMatchTheReference) {
  expectRangeMatches<float>(between(0, 10), 10, 0);
  expectRangeMatches<float>(between(0, 10), 6, 5);
  expectRangeMatches<float>(between(0, 10), 5, 6);
  expectRangeMatches<float>(between(-10, 0), -6, -5);
  expectRangeMatches<std::uint8_t>(between(0, 255), 300, 100);
  expectRangeMatches<float>(between(0, 10), 4, 1e9);  // the data fill the lowest billionth
}

}  // namespace
}  // namespace scolopax
