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

/// A file of volumes "a/b" with channels x and y, "a/c" and "d", without a file.
VolumeFile invented() {
  VolumeFile file{"f.h5"};
  const std::vector<Grid> levels{Grid{}};
  file.volumes = {{.path = "a/b", .levels = levels, .channels = {{.name = "x"}, {.name = "y"}}},
                  {.path = "a/c", .levels = levels, .channels = {{.name = "c"}}},
                  {.path = "d", .levels = levels, .channels = {{.name = "y"}}}};
  return file;
}

TEST(NamesInsideFiles, SelectAVolumeOrAGroupOrChannels) {
  const VolumeFile file = invented();
  const auto selected = [&](const std::string& inner) {
    std::string text;
    for (const Part& part : partsOf(file, inner)) {
      text += std::to_string(part.volume) + ":";
      for (const std::size_t channel : part.channels) text += std::to_string(channel);
      text += " ";
    }
    return text;
  };
  EXPECT_EQ(selected(""), "0: 1: 2: ");
  EXPECT_EQ(selected("/a/b"), "0: ");
  EXPECT_EQ(selected("a"), "0: 1: ");
  EXPECT_EQ(selected("/a/"), "0: 1: ");
  EXPECT_EQ(selected("a/b/y"), "0:1 ");
  EXPECT_EQ(selected("y"), "0:1 2:0 ");
  EXPECT_THAT(errorOf([&] { selected("/e"); }),
              HasSubstr("f.h5: expected one of a/b, a/c, d after the colon, found \"/e\""));
}

TEST(NamesInsideFiles, FollowAColonUnlessThePathExistsAsItStands) {
  const TempDir folder;
  const auto plain = writeBytes(folder / "a", ""), colon = writeBytes(folder / "a:b", "");
  const auto split = [](const std::filesystem::path& name) {
    const DataName parts = splitName(name);
    return std::pair(parts.path, parts.inner);
  };
  EXPECT_EQ(split(plain), std::pair(plain, std::string()));
  EXPECT_EQ(split(colon), std::pair(colon, std::string()));
  EXPECT_EQ(split(folder / "a:c:d"), std::pair(plain, std::string("c:d")));
  EXPECT_EQ(split(folder / "a:b:c"), std::pair(plain, std::string("b:c")));
  EXPECT_EQ(split(folder / "z:c"), std::pair(folder / "z:c", std::string()));
  EXPECT_EQ(split(folder.path() / ""), std::pair(folder.path(), std::string())) << "without the slash";
}

/// A NRRD of `channels` channels of one voxel, that begin with 0, 1, 2, ...
std::filesystem::path list(const TempDir& folder, int channels) {
  std::string text = "NRRD0004\ntype: uint8\ndimension: 4\nencoding: raw\nkinds: domain domain domain list\n";
  text += "sizes: 1 1 1 " + std::to_string(channels) + "\n\n";
  for (int i = 0; i < channels; ++i) text += char(i);
  return writeBytes(folder / "many.nrrd", text);
}

TEST(LoadDatasets, OfAFileWithTooManyChannelsSomeAreChosenByName) {
  const TempDir folder;
  const auto path = list(folder, 33);
  EXPECT_THAT(
      errorOf([&] { openDatasets(std::vector{path}); }),
      testing::AllOf(HasSubstr("many.nrrd: expected at most 32 channels on one grid, found 33; choose some"),
                     HasSubstr("many 0, many 1, "), HasSubstr("many 32")));
  const std::vector<std::filesystem::path> names{path.string() + ":many 32", path.string() + ":many 7"};
  const auto datasets = loadDatasets(names, kTestLimit, {});
  ASSERT_EQ(datasets.size(), 1u);
  EXPECT_EQ(datasets[0].id, "many-many-32");
  EXPECT_EQ(datasets[0].title, "many.nrrd:many 32");
  ASSERT_EQ(datasets[0].volume->channels().size(), 2u);
  EXPECT_EQ(datasets[0].volume->channels()[0].histogram.minimum, 32);
  EXPECT_EQ(datasets[0].volume->channels()[1].histogram.minimum, 7);
}

TEST(OpenFile, LooksAtTheContentsBeforeTheName) {
  const TempDir folder;
  const auto path = list(folder, 2);
  std::filesystem::copy_file(path, folder / "a.nii");
  std::filesystem::copy_file(path, folder / "without");
  EXPECT_EQ(openFile(folder / "a.nii")->volumes[0].channels.size(), 2u);
  EXPECT_EQ(openFile(folder / "without")->volumes[0].channels.size(), 2u);
  // Such a name is the header, and these are voxels.
  std::string voxels = "NRRD0004";
  EXPECT_EQ(openFile(writeBytes(folder / "v_8x1x1_uint8.raw", voxels))->volumes[0].levels[0].dims.x, 8);
}

TEST(OpenFile, OfAFormatWithoutItsLibraryNamesTheLibrary) {
  const TempDir folder;
  const Format lacking{"HDF5", ".h5", "libhdf5-dev", nullptr, nullptr};
  const auto path = writeBytes(folder / "a.h5", "x");
  EXPECT_THAT(errorOf([&] { openFile(lacking, path); }),
              HasSubstr("a.h5: HDF5 needs the library of libhdf5-dev, without which this program was built"));
}

TEST(OpenFile, ReadsNoVoxels) {
  const TempDir folder;
  const auto path = writeBytes(folder / "a_4096x4096x4096_uint16.raw", "");
  std::filesystem::resize_file(path, std::uint64_t(1) << 37);
  const auto dataset = openDatasets(std::vector{path}).at(0);
  EXPECT_EQ(memoryBytes(dataset), std::uint64_t(1) << 37);
  EXPECT_THAT(
      errorOf([&] { loadVolume(dataset, 0, 0, {.memoryLimitBytes = kTestLimit}); }),
      HasSubstr("4096x4096x4096 voxels of 1 channel needs 137438953472 bytes of memory, the limit is"));
}

TEST(LoadDatasets, TimesAndAVolumeOfOneTimeShareADataSet) {
  const TempDir folder;
  const std::string header = "NRRD0004\ntype: uint8\nencoding: raw\n";
  const std::vector<std::filesystem::path> paths{
      writeBytes(folder / "s_t.nrrd", header +
                                          "dimension: 4\nsizes: 1 1 1 2\nunits: \"\" \"\" \"\" \"ms\"\n"
                                          "spacings: 1 1 1 5\nspace units: \"um\" \"um\" \"um\"\n\n\x01\x02"),
      writeBytes(folder / "s_m.nrrd", header + "dimension: 3\nsizes: 1 1 1\n\n\x03")};
  const auto opened = openDatasets(paths);
  ASSERT_EQ(opened.size(), 1u);
  EXPECT_EQ(opened[0].times.count, 2u);
  EXPECT_THAT(opened[0].times.values, ElementsAre(0, 5));
  EXPECT_EQ(opened[0].times.unit, "ms");
  EXPECT_EQ(opened[0].worldUnit, "um");
  EXPECT_EQ(opened[0].channels[1].name, "m");
  const auto second = loadDatasets(opened, 1, {}).at(0).volume;
  EXPECT_EQ(second->channels()[0].histogram.minimum, 2);
  EXPECT_EQ(second->channels()[1].histogram.minimum, 3);
  EXPECT_THAT(errorOf([&] { loadDatasets(opened, 2, {}); }), HasSubstr("time: expected 0 to 1, found 2"));
}

TEST(LoadDatasets, NoFilesAreNoDataSets) { EXPECT_TRUE(openDatasets({}).empty()); }

TEST(DefaultMemoryLimit, IsAPlausiblePartOfAMachine) {
  EXPECT_GT(defaultMemoryLimitBytes(), std::uint64_t(1) << 26);
}

}  // namespace
}  // namespace scolopax::io
