// SPDX-License-Identifier: Apache-2.0
// Sampling many points at once gives the same bits as sampling them one by one, in every instruction set.
#include "tests/support/sample_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "renderer/cpu/instruction_set.h"
#include "renderer/data/field_view.h"
#include "renderer/data/volume.h"
#include "renderer/kernel/filters.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

class LaneSampling : public testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    if (!available(GetParam())) GTEST_SKIP() << "this processor does not have the instruction set";
  }
};

/// Random bits: all values of a type, including infinities and NaNs of floats.
VoxelBuffer randomVoxels(ScalarType type, glm::ivec3 dims, std::mt19937& random) {
  VoxelBuffer voxels(type, std::size_t(dims.x) * std::size_t(dims.y) * std::size_t(dims.z));
  for (std::size_t i = 0; i < voxels.sizeBytes(); ++i) voxels.data()[i] = std::byte(random());
  if (type != ScalarType::f32) return voxels;
  for (float& v : voxels.as<float>())
    if (random() % 8 != 0) v = std::ldexp(float(int(random() % 2001) - 1000), int(random() % 60) - 30);
  return voxels;
}

/// A view of the channels of one volume, all of them visible.
struct Channels {
  Volume volume;
  std::vector<kernel::ChannelView> views;
  kernel::SceneView scene{};

  Channels(glm::ivec3 dims, const std::vector<ScalarType>& types, std::mt19937& random)
      : volume(gridOf(dims), sources(dims, types, random)) {
    for (const Channel& channel : volume.channels()) {
      kernel::ChannelView view{};
      // Most are trilinear, so that several of these are neighbours.
      view.field = fieldView(channel, Interpolation(std::max(0, int(random() % 6) - 3)));
      views.push_back(view);
    }
    scene.dims = dims;
    scene.channels = views.data();
    scene.channelCount = int(views.size());
  }
  static std::vector<ChannelSource> sources(glm::ivec3 dims, const std::vector<ScalarType>& types,
                                            std::mt19937& random) {
    std::vector<ChannelSource> sources(types.size());
    for (std::size_t i = 0; i < types.size(); ++i) sources[i].voxels = randomVoxels(types[i], dims, random);
    return sources;
  }
};

TEST_P(LaneSampling, HasTheBitsOfSamplingOneChannelAtOnePointAfterTheOther) {
  constexpr ScalarType u8 = ScalarType::u8, u16 = ScalarType::u16, i16 = ScalarType::i16,
                       f32 = ScalarType::f32;
  std::mt19937 random(20);
  std::uniform_real_distribution<float> within(-1.5f, 1.5f);
  const test::LaneSampler sampler =
      GetParam() == InstructionSet::avx2 ? avx2LaneSampler() : avx512LaneSampler();
  int compared = 0, finite = 0;
  for (const glm::ivec3 dims :
       {glm::ivec3(1, 1, 1), glm::ivec3(2, 2, 2), glm::ivec3(1, 9, 5), glm::ivec3(7, 1, 5),
        glm::ivec3(7, 9, 1), glm::ivec3(3, 2, 5), glm::ivec3(17, 13, 11)})
    for (const std::vector<ScalarType>& types :
         {std::vector{u8}, std::vector{u16}, std::vector{i16}, std::vector{f32}, std::vector{u8, u8, u8, u8},
          std::vector{i16, i16, i16}, std::vector{f32, u16, f32, u8, u16, f32, f32, f32, i16, f32},
          std::vector<ScalarType>(9, u16)}) {
      const Channels made(dims, types, random);
      const std::uint32_t all = (1u << types.size()) - 1;
      for (int round = 0; round < 100; ++round) {
        // Along a ray with parts outside, on faces and on voxels; or anywhere.
        glm::vec3 points[kMostLanes];
        const glm::vec3 size(dims), origin = glm::vec3(within(random), within(random), within(random)) * size;
        const glm::vec3 step = glm::vec3(within(random), within(random), within(random)) * 0.6f;
        for (int i = 0; i < sampler.lanes; ++i) {
          glm::vec3 p = origin + float(i) * step;
          if (round % 4 == 1) p = glm::round(p * 2.0f) * 0.5f;
          if (round % 4 == 2) p = glm::vec3(within(random), within(random), within(random)) * size;
          if (round % 4 == 3) p[round / 4 % 3] = i % 2 ? -0.0f : float(dims[round / 4 % 3] - 1);
          points[i] = p;
        }
        const std::uint32_t channels = round % 3 ? all & std::uint32_t(random()) : all;
        float values[kernel::kMaxVisibleChannels][kMostLanes];
        for (auto& row : values) std::fill(std::begin(row), std::end(row), -12345.0f);
        sampler.sample(made.scene, channels, points, values);
        for (int n = 0; n < int(types.size()); ++n)
          for (int i = 0; i < sampler.lanes; ++i) {
            const float found = values[n][i];
            if (!(channels >> n & 1)) {
              ASSERT_EQ(found, -12345.0f) << "nobody has asked";
              continue;
            }
            const float expected =
                kernel::sampleStored<kernel::One>(made.views[std::size_t(n)].field, dims, points[i]);
            ++compared;
            if (!std::isfinite(expected)) {  // any NaN will do
              ASSERT_FALSE(std::isfinite(found));
              continue;
            }
            ++finite;
            ASSERT_EQ(std::memcmp(&found, &expected, sizeof expected), 0)
                << found << " for " << expected << " of channel " << n << " at " << points[i].x << ' '
                << points[i].y << ' ' << points[i].z << " of " << dims.x << 'x' << dims.y << 'x' << dims.z;
          }
      }
    }
  EXPECT_GT(finite, compared / 2);
}

TEST_P(LaneSampling, ReachesVoxelsBeyondIndicesOf32Bits) {
  // 2^32 voxels; only the memory that is touched is allocated.
  const glm::ivec3 dims(1 << 12, 1 << 12, (1 << 8) + 2);
  const std::size_t slice = std::size_t(dims.x) * std::size_t(dims.y);
  VoxelBuffer voxels(ScalarType::u8, slice * std::size_t(dims.z));
  for (const int z : {0, dims.z - 2, dims.z - 1})
    for (const int row : {0, 1, dims.y - 2, dims.y - 1})
      for (int x = 0; x < 8; ++x)
        voxels.data()[std::size_t(z) * slice + std::size_t(row) * std::size_t(dims.x) + std::size_t(x)] =
            std::byte(7 * x + z % 200);
  kernel::ChannelView channel{};
  channel.field.voxels = voxels.data();
  channel.field.type = ScalarType::u8;
  channel.field.stride = 1;
  kernel::SceneView scene{};
  scene.dims = dims;
  scene.channels = &channel;
  scene.channelCount = 1;
  const test::LaneSampler sampler =
      GetParam() == InstructionSet::avx2 ? avx2LaneSampler() : avx512LaneSampler();
  for (const bool across : {false, true}) {
    glm::vec3 points[kMostLanes];
    for (int i = 0; i < sampler.lanes; ++i) {
      points[i] = glm::vec3(float(i) * 0.4f, float(dims.y - 1) - 0.25f,
                            across && i < 4 ? 0.0f : float(dims.z - 2) + 0.5f);
    }
    float values[1][kMostLanes];
    sampler.sample(scene, 1, points, values);
    for (int i = 0; i < sampler.lanes; ++i)
      EXPECT_EQ(values[0][i], kernel::sampleStored<kernel::One>(channel.field, dims, points[i]));
  }
}

INSTANTIATE_TEST_SUITE_P(Of, LaneSampling, testing::Values(InstructionSet::avx2, InstructionSet::avx512),
                         [](const auto& set) {
                           return std::string(set.param == InstructionSet::avx2 ? "Avx2" : "Avx512");
                         });

}  // namespace
}  // namespace scolopax
