// SPDX-License-Identifier: Apache-2.0
// The trackers with random numbers chosen by the test: both ends of every draw, and the exact distribution of
// the free flight.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "renderer/data/render_plan.h"
#include "renderer/kernel/collision.h"
#include "tests/support/volumes.h"

namespace scolopax::kernel {
/// A sampler that returns the same block for every draw.
struct ScriptedSampler {
  RandomBlock block;
  RandomBlock next() { return block; }
  static std::uint32_t blocks() { return 0; }
  static void skipTo(std::uint32_t) {}
};
}  // namespace scolopax::kernel
// Compiles the trackers with this sampler instead.
#define Sampler ScriptedSampler
#include "renderer/kernel/trackers/one_process.h"
#include "renderer/kernel/trackers/process_per_channel.h"
#undef Sampler

namespace scolopax::kernel {
namespace {

using namespace test;

constexpr std::uint32_t kLow = 0, kHigh = 0xffffffffu;
const Ray kAlongZ{{0, 0, -3}, {0, 0, 1}};

/// The next lower density that a macrocell's total represents exactly: the bound then equals the extinction,
/// and the distribution of a single draw is known to the last bits.
double heldExactly(double density) {
  return double(std::bit_cast<float>(std::bit_cast<std::uint32_t>(float(density)) & 0xffff0000u));
}

struct Outcome {
  std::optional<Collision> hit;
  SampleCost cost;
};

template <class Tracker>
Outcome track(const RenderPlan& plan, RandomBlock block) {
  ScriptedSampler sampler{block};
  Outcome outcome;
  const Interval inside = clipToScene(plan.view(), kAlongZ);
  outcome.hit = Tracker::template track<BlendDensity>(plan.view(), kAlongZ, inside, sampler, &outcome.cost);
  return outcome;
}

template <class Tracker>
class Draws : public testing::Test {};
using Trackers = testing::Types<Superposed, Cumulative, SyncDda, NDda>;
TYPED_TEST_SUITE(Draws, Trackers);

TYPED_TEST(Draws, AtTheirEndsOnlyHitChannelsThatHaveExtinction) {
  const glm::ivec3 dims(1, 1, 6);
  const auto zero = [](int, int, int) { return 0; };
  const auto one = [](int, int, int) { return 1; };
  const auto volume = volumeOf(gridOf(dims), channelOf<float>(dims, zero), channelOf<float>(dims, one),
                               channelOf<float>(dims, one), channelOf<float>(dims, zero));
  for (const double wanted : {1e-6, 0.3, 30.0, 1e6}) {
    const double density = heldExactly(wanted);
    Scene scene = frontScene(*volume, 1, 1);
    for (auto& channel : scene.channels) channel.density = density;  // a ramp: 0 in the outer two
    const RenderPlan plan(volume, scene);
    ASSERT_EQ(plan.view().channelCount, 4);
    for (const std::uint32_t x : {kLow, kHigh})
      for (const std::uint32_t y : {kLow, kHigh})
        for (const std::uint32_t z : {kLow, kHigh}) {
          const Outcome found = track<TypeParam>(plan, {x, y, z, 0});
          const double depth = double(opticalDepth(uniformOf(x)));
          EXPECT_EQ(found.cost.truncated, 0u);
          if (x == kLow ||
              density > 16.7 / 4) {  // the flight ends within one macrocell of 4 voxels for any tracker
            ASSERT_TRUE(found.hit) << density << " " << x << " " << y << " " << z;
            EXPECT_TRUE(found.hit->channel == 1 || found.hit->channel == 2);
            EXPECT_GE(found.hit->distance.t(), 2.5f);
            EXPECT_LE(found.hit->distance.t(), 2.5 + depth / density + 1e-6);
          } else if (density < 1) {
            EXPECT_FALSE(found.hit);
          }
        }
  }
}

TYPED_TEST(Draws, ThatNeverAcceptNorAdvanceEndAtTheBound) {
  const glm::ivec3 dims(1, 1, 6);
  const auto volume =
      volumeOf(gridOf(dims), channelOf<float>(dims, [](int, int, int z) { return float(z); }));
  Scene scene = frontScene(*volume, 1, 1);
  scene.channels[0].rangeHi = 5;
  scene.channels[0].opacity = {{0, 0}, {0.5, 1}};  // 0 at the box's face, 1 is the bound of every cell
  const RenderPlan plan(volume, scene);
  const Outcome found = track<TypeParam>(plan, {kLow, kHigh, kHigh, 0});
  EXPECT_FALSE(found.hit);
  EXPECT_EQ(found.cost.truncated, 1u);
  EXPECT_EQ(found.cost.fetches, kMaxTentativeCollisions);
}

TYPED_TEST(Draws, EndTheFlightWhereTheOpticalDepthSaysFromOneMillionthToOneMillion) {
  const glm::ivec3 dims(1, 1, 40);
  const auto volume = volumeOf(gridOf(dims), channelOf<std::uint8_t>(dims, [](int, int, int) { return 1; }));
  // Trackers with one process carry the draw across all cells. Those with a process per channel draw in every
  // cell, so they get a single cell.
  for (const int macrocell : {1, 7, 64}) {
    if ((std::is_same_v<TypeParam, SyncDda> || std::is_same_v<TypeParam, NDda>)&&macrocell < 64) continue;
    for (const double wanted : {1e-6, 1e-5, 1e-3, 0.1, 1.0, 5.0, 15.0, 100.0, 1e3, 1e6}) {
      const double density = heldExactly(wanted / 40), thickness = density * 40;
      Scene scene = frontScene(*volume, 1, 1);
      scene.macrocell = macrocell;
      scene.channels[0] = solid(density);
      const RenderPlan plan(volume, scene);
      // First k whose flight leaves the box: k / 2^32 is the probability of a collision.
      std::uint32_t low = 0, high = kHigh;
      while (low < high) {
        const std::uint32_t middle = low + (high - low) / 2;
        const auto hit = track<TypeParam>(plan, {middle, 0, kHigh, 0}).hit;
        if (hit) {
          const double depth = -std::log1p(-double(uniformOf(middle)));
          // Half an ulp lost per cell, and a few in the logarithm and t.
          const double tolerance = (40.0 / macrocell + 8) * 43 * 0x1p-24;
          EXPECT_NEAR(double(hit->distance.t()), 2.5 + depth / thickness * 40, tolerance);
          low = middle + 1;
        } else {
          high = middle;
        }
      }
      const double expected = -std::expm1(-thickness);
      EXPECT_NEAR(double(low) * 0x1p-32 / expected, 1, 0x1p-31 / thickness + 4e-6) << thickness;
    }
  }
}

TEST(Counters, StayDifferentWhereCountersWrapAround) {
  // Neighbouring seeds, pixels and samples, and those next to overflow: no two draw the same block.
  const std::uint32_t ends[] = {0, 1, 0x7fffffffu, 0x80000000u, 0xfffffffeu, 0xffffffffu};
  std::vector<std::array<std::uint32_t, 4>> seen;
  for (const std::uint32_t pixel : ends)
    for (const std::uint32_t sample : ends)
      for (const std::uint32_t seed : ends) {
        const SampleNumber number{sample, false, {}};
        Sampler sampler(pixel, number, seed);
        for (int block = 0; block < 4; ++block) {
          const RandomBlock r = sampler.next();
          seen.push_back({r.x, r.y, r.z, r.w});
        }
      }
  const std::size_t count = seen.size();
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::size_t(std::unique(seen.begin(), seen.end()) - seen.begin()), count);
}

}  // namespace
}  // namespace scolopax::kernel
