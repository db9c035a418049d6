// SPDX-License-Identifier: Apache-2.0
// Zarr version 3 and OME-Zarr 0.5: the collection, whose sums were computed by a separate decoder.
#include <gmock/gmock.h>

#include "tests/renderer/io/zarr_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const LoadOptions kZarr3Load{.memoryLimitBytes = kTestLimit};

TEST(Zarr3Files, TimesChannelsAndLevelsLoad) {
  const auto path = dataFile("formats/ome_zarr_v3/fiji_5d_v05.ome.zarr");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 1u);
  const VolumeInfo& volume = file->volumes[0];
  EXPECT_EQ(volume.times.count, 4u);
  EXPECT_EQ(volume.levels[0].dims, glm::ivec3(64, 64, 16));
  EXPECT_EQ(volume.levels[1].dims, glm::ivec3(32, 32, 8));
  EXPECT_EQ(volume.levels[1].spacing(), glm::dvec3(2));
  ASSERT_EQ(volume.channels.size(), 3u);
  EXPECT_EQ(volume.channels[1].name, "NLStdTomato");
  EXPECT_EQ(volume.channels[1].look.color, (std::array<std::uint8_t, 3>{255, 0, 0}));
  EXPECT_EQ(volume.channels[1].look.window->lo, 6);
  EXPECT_EQ(volume.channels[1].look.window->hi, 133);
  constexpr double kFine[4][3] = {{8159554, 11436354, 12668738},
                                  {9470274, 12656706, 10252098},
                                  {10780994, 13075778, 6773058},
                                  {12086082, 11712834, 4164418}};
  for (std::size_t time = 0; time < 4; ++time) {
    const LoadedPart part = load(*file, {.time = time}, kZarr3Load);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(sumOf(part.channels[c]), kFine[time][c]) << time << c;
  }
  const LoadedPart coarse = load(*file, {.level = 1, .time = 3, .channels = {0, 2}}, kZarr3Load);
  EXPECT_EQ(sumOf(coarse.channels[0]), 1491313);
  EXPECT_EQ(sumOf(coarse.channels[1]), 541297);
}

TEST(Zarr3Files, EveryLevelOfAPyramidIsItsOwn) {
  const auto path = dataFile("formats/ome_zarr_v3/fiji_pyramid_v05.zarr");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  const VolumeInfo& volume = file->volumes[0];
  ASSERT_EQ(volume.levels.size(), 3u);
  EXPECT_EQ(volume.levels[0].dims, glm::ivec3(1000, 1000, 500));
  EXPECT_EQ(volume.levels[1].dims, glm::ivec3(500, 500, 250));
  EXPECT_EQ(volume.levels[2].dims, glm::ivec3(250, 250, 250));
  EXPECT_EQ(volume.levels[2].spacing(), glm::dvec3(4, 4, 2));
  EXPECT_EQ(glm::dvec3(volume.levels[2].worldFromVoxel[3]), glm::dvec3(1.5, 1.5, 0.5));
  const LoadedPart coarse = load(*file, {.level = 2}, kZarr3Load);
  EXPECT_EQ(rangeOf(coarse.channels[0]), std::pair(20.0, 60.0));
  EXPECT_EQ(sumOf(coarse.channels[0]), 349255000);
  const LoadedPart middle = load(*file, {.level = 1}, kZarr3Load);
  const auto voxels = middle.channels[0].voxels.as<std::uint8_t>();
  EXPECT_EQ(*std::ranges::min_element(voxels), 100);
  EXPECT_EQ(*std::ranges::max_element(voxels), 140);
}

TEST(Zarr3Files, LabelsOfVersion05AreVolumes) {
  const auto path = dataFile("formats/ome_zarr_v3/zarrjava_v05_labels.zarr");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_EQ(file->volumes[0].levels[0].spacing(), glm::dvec3(0.5));
  EXPECT_EQ(file->volumes[0].levels[1].spacing(), glm::dvec3(1));
  EXPECT_EQ(file->volumes[0].worldUnit, "um");
  EXPECT_EQ(file->volumes[0].channels[0].name, "DAPI");
  EXPECT_EQ(file->volumes[0].channels[0].look.color, (std::array<std::uint8_t, 3>{0, 0, 255}));
  EXPECT_EQ(file->volumes[1].path, "labels/nuclei");
  EXPECT_TRUE(file->volumes[1].channels[0].look.labels);
  const LoadedPart voxels = load(*file, {}, kZarr3Load);
  EXPECT_NEAR(sumOf(voxels.channels[0]), 1025.2696768641472, 1e-6);
  EXPECT_NEAR(sumOf(voxels.channels[1]), 1024.2356457710266, 1e-6);
  EXPECT_NEAR(sumOf(load(*file, {.level = 1}, kZarr3Load).channels[0]), 131.1166696548462, 1e-6);
  const LoadedPart nuclei = load(*file, {.volume = 1}, kZarr3Load);
  EXPECT_EQ(rangeOf(nuclei.channels[0]), std::pair(0.0, 2.0));
  EXPECT_EQ(sumOf(nuclei.channels[0]), 2010);
}

TEST(Zarr3Files, ShardsWithTheIndexAtEitherEndLoad) {
  for (const char* place : {"start", "end"}) {
    const auto path = dataFile("formats/ome_zarr_v3/sharding_index_location") / place;
    SKIP_WITHOUT(path);
    EXPECT_EQ(openFile(path)->volumes[0].levels[0].dims, glm::ivec3(16));
    EXPECT_EQ(zarrValues(path), rampUpTo(4096)) << place;
  }
}

TEST(Zarr3Files, AShardLargerThanItsArrayWithXFirstLoads) {
  const auto path = dataFile("formats/ome_zarr_v3/webknossos_sharded_3ch");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 1u);
  EXPECT_EQ(file->volumes[0].levels[0].dims, glm::ivec3(24));
  EXPECT_EQ(file->volumes[0].levels[0].spacing(), glm::dvec3(1));
  EXPECT_EQ(file->volumes[0].worldUnit, "nm");
  const LoadedPart part = load(*file, {}, kZarr3Load);
  ASSERT_EQ(part.channels.size(), 3u);
  for (const ChannelSource& channel : part.channels) {
    EXPECT_EQ(rangeOf(channel), std::pair(0.0, 255.0));
    EXPECT_EQ(sumOf(channel), 1762560);
    // Each axis has another first moment.
    const auto values = valuesOf(channel);
    glm::dvec3 moment(0);
    for (int i = 0; i < 24 * 24 * 24; ++i)
      moment += values[std::size_t(i)] * glm::dvec3(i % 24, i / 24 % 24, i / 576);
    EXPECT_EQ(moment, glm::dvec3(20392320, 20462976, 20342016));
  }
}

TEST(Zarr3Files, AxesThatTheMetadataForgotAreTakenFromTheArray) {
  const auto path = dataFile("formats/ome_zarr_v3/webknossos_sharded_4d_subset");
  SKIP_WITHOUT(path);
  std::vector<std::string> warnings;
  const auto file = openFile(path, {.warn = [&](const std::string& line) { warnings.push_back(line); }});
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("multiscales: expected below \"ome\""),
                                    HasSubstr("axes: expected 5, as many as the array has, found 4")));
  const VolumeInfo& volume = file->volumes[0];
  EXPECT_EQ(volume.times.count, 7u);
  EXPECT_EQ(volume.channels.size(), 1u);
  EXPECT_EQ(volume.channels[0].type, StoredType::i8);
  ASSERT_EQ(volume.levels.size(), 2u);
  EXPECT_EQ(volume.levels[0].dims, glm::ivec3(439, 192, 4096));
  EXPECT_EQ(volume.levels[1].dims, glm::ivec3(220, 96, 4096));
  EXPECT_EQ(volume.levels[0].spacing(), glm::dvec3(10));
  EXPECT_EQ(volume.levels[1].spacing(), glm::dvec3(20));
  EXPECT_EQ(volume.worldUnit, "nm");
  constexpr double kSums[] = {2140879, 2140689, 0};
  for (const std::size_t time : {0u, 1u, 6u}) {
    const LoadedPart part = load(*file, {.level = 1, .time = time}, kZarr3Load);
    double sum = 0;
    for (const std::int16_t voxel : part.channels[0].voxels.as<std::int16_t>()) sum += voxel;
    EXPECT_EQ(sum, kSums[std::min<std::size_t>(time, 2)]) << time;
  }
}

}  // namespace
}  // namespace scolopax::io
