// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::filesystem::path cube(const TempDir& folder, const std::string& stem, int size) {
  const std::string side = std::to_string(size);
  return writeBytes(folder / (stem + "_" + side + "x" + side + "x" + side + "_uint8.raw"),
                    std::string(std::size_t(size * size * size), char(size)));
}

TEST(LoadDatasets, FilesOfOneGridBecomeOneDataSetInOrderOfAppearance) {
  const TempDir folder;
  const std::vector<std::filesystem::path> paths{cube(folder, "b", 2), cube(folder, "big", 3),
                                                 cube(folder, "a", 2)};
  const auto datasets = loadDatasets(paths, kTestLimit, {});
  ASSERT_EQ(datasets.size(), 2u);
  EXPECT_EQ(datasets[0].id, "b-2x2x2-uint8");
  EXPECT_EQ(datasets[0].title, "b_2x2x2_uint8.raw +1");
  EXPECT_THAT(datasets[0].files, ElementsAre(paths[0], paths[2]));
  ASSERT_EQ(datasets[0].volume->channels().size(), 2u);
  EXPECT_EQ(datasets[0].volume->channels()[0].name, "b");
  EXPECT_EQ(datasets[0].volume->channels()[1].name, "a");
  EXPECT_EQ(datasets[1].id, "big-3x3x3-uint8");
}

TEST(LoadDatasets, IdsAreSlugsAndUnique) {
  const TempDir folder;
  std::vector<std::filesystem::path> paths;
  for (const char* parent : {"one", "two", "three"}) {
    std::filesystem::create_directory(folder / parent);
    const int size = int(paths.size()) + 1;
    writeBytes(folder / (std::string(parent) + "/v.raw"), std::string(std::size_t(size), 'x'));
    paths.push_back(
        writeBytes(folder / (std::string(parent) + "/T\xC3\xA4st  (1)_.dat"),
                   "ObjectFileName: v.raw\nFormat: UCHAR\nResolution: 1 1 " + std::to_string(size) + "\n"));
  }
  paths.push_back(writeBytes(folder / "one/\xFF.dat",
                             "ObjectFileName: v.raw\nFormat: UCHAR\nResolution: 1 1 1\nSpacing: 2 2 2\n"));
  const auto datasets = loadDatasets(paths, kTestLimit, {});
  ASSERT_EQ(datasets.size(), 4u);
  EXPECT_EQ(datasets[0].id, "t-st-1");
  EXPECT_EQ(datasets[1].id, "t-st-1-2");
  EXPECT_EQ(datasets[2].id, "t-st-1-3");
  EXPECT_EQ(datasets[3].id, "volume");
  EXPECT_EQ(datasets[3].title, "?.dat") << "titles are valid UTF-8";
}

TEST(LoadDatasets, MoreChannelsThanAVolumeHoldsAreRefused) {
  const TempDir folder;
  const std::vector<std::filesystem::path> paths(kMaxChannels + 1, cube(folder, "a", 2));
  EXPECT_THAT(errorOf([&] { loadDatasets(paths, kTestLimit, {}); }),
              HasSubstr("expected at most 32 channels"));
  EXPECT_EQ(loadDatasets(std::span(paths).first(kMaxChannels), kTestLimit, {})[0].volume->channels().size(),
            32u);
}

TEST(LoadDatasets, TheMemoryLimitHoldsForAllFilesTogether) {
  const TempDir folder;
  const std::vector<std::filesystem::path> paths{cube(folder, "a", 4), cube(folder, "b", 4)};
  EXPECT_EQ(loadDatasets(paths, 128, {}).size(), 1u);
  EXPECT_THAT(errorOf([&] { loadDatasets(paths, 127, {}); }),
              HasSubstr("a_4x4x4_uint8.raw +1: 4x4x4 voxels of 2 channels needs 128 bytes of memory, the "
                        "limit is 127 bytes"));
}

TEST(LoadDatasets, AFileGivenWithItsHeaderIsLoadedOnceWhicheverComesFirst) {
  const TempDir folder;
  const auto raw = cube(folder, "a", 2), other = cube(folder, "b", 2);
  const auto dat =
      writeBytes(folder / "a.dat", "ObjectFileName: a_2x2x2_uint8.raw\nFormat: UCHAR\nResolution: 2 2 2\n");
  const auto nhdr = writeBytes(folder / "a.nhdr",
                               "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
                               "data file: a_2x2x2_uint8.raw\n");
  for (const auto& header : {dat, nhdr}) {
    for (const auto& paths : {std::vector{header, raw, other}, std::vector{raw, header, other},
                              std::vector{raw, other, folder / "." / header.filename().string()}}) {
      const auto datasets = loadDatasets(paths, 2 * 8, {});
      ASSERT_EQ(datasets.size(), 1u);
      EXPECT_EQ(datasets[0].volume->channels().size(), 2u);
      EXPECT_EQ(datasets[0].files.size(), 2u);
    }
  }
  // The same file twice is intended: a channel can be shown in two ways.
  EXPECT_EQ(loadDatasets(std::vector{raw, raw}, kTestLimit, {})[0].volume->channels().size(), 2u);
}

TEST(LoadDatasets, ADataSetOfSeveralFilesSaysSoInItsTitle) {
  const TempDir folder;
  const std::vector<std::filesystem::path> paths{cube(folder, "a", 2), cube(folder, "b", 2),
                                                 cube(folder, "c", 2)};
  EXPECT_EQ(loadDatasets(paths, kTestLimit, {})[0].title, "a_2x2x2_uint8.raw +2");
}

TEST(LoadDatasets, NoFilesAreNoDataSets) { EXPECT_TRUE(openDatasets({}).empty()); }

TEST(DefaultMemoryLimit, IsAPlausiblePartOfAMachine) {
  EXPECT_GT(defaultMemoryLimitBytes(), std::uint64_t(1) << 26);
}

}  // namespace
}  // namespace scolopax::io
