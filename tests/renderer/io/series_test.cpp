// SPDX-License-Identifier: Apache-2.0
// Folders, and time series in several files.
#include "renderer/io/series.h"

#include <gmock/gmock.h>

#include "renderer/io/folder.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

/// A raw file of size^3 voxels that are all `value`.
fs::path cube(const fs::path& folder, const std::string& stem, int size, char value) {
  const std::string side = std::to_string(size);
  fs::create_directories(folder);
  return writeBytes(folder / (stem + ".nrrd"), "NRRD0004\ntype: uint8\ndimension: 3\nsizes: " + side + " " +
                                                   side + " " + side + "\nencoding: raw\n\n" +
                                                   std::string(std::size_t(size * size * size), value));
}

std::vector<std::string> titles(const std::vector<Dataset>& datasets) {
  std::vector<std::string> all;
  for (const Dataset& dataset : datasets) all.push_back(dataset.title);
  return all;
}

std::vector<Dataset> open(const std::vector<fs::path>& paths, OpenOptions options = {}) {
  return openDatasets(paths, options);
}

TEST(ComesBefore, ComparesDigitsAsNumbers) {
  EXPECT_TRUE(comesBefore("a9", "a10"));
  EXPECT_FALSE(comesBefore("a10", "a9"));
  EXPECT_TRUE(comesBefore("a007b", "a8a"));
  EXPECT_TRUE(comesBefore("a", "a1"));
  EXPECT_TRUE(comesBefore("a1", "b"));
  EXPECT_FALSE(comesBefore("a1", "a1"));
  EXPECT_NE(comesBefore("a01", "a1"), comesBefore("a1", "a01")) << "a strict order, also of equal numbers";
}

TEST(NumberedName, IsSplitAtItsLastNumber) {
  const std::string name = "run01_density_0025.vti";
  const NumberedName split = numberedName(name);
  EXPECT_TRUE(split.numbered);
  EXPECT_EQ(split.before, "run01_density_");
  EXPECT_EQ(split.number, 25);
  EXPECT_EQ(split.after, ".vti");
  EXPECT_EQ(numberedName("out.0012.vti").number, 12);
  EXPECT_EQ(numberedName("scan_012.nii.gz").number, 12);
}

TEST(NumberedName, LeavesOutWhatDoesNotCountSteps) {
  for (const char* name : {"t1.nii", "brain.hdf5", "scan_ch01.tif", "img-Channel_02.tif", "stack_z012.tif",
                           "w01.tif", "99999999999999999999999.vti", "", ".", "..gz"})
    EXPECT_FALSE(numberedName(name).numbered) << name;
  EXPECT_TRUE(numberedName("search01.tif").numbered) << "only whole words count";
}

TEST(Series, AreMadeOfNumberedFilesOfOneGrid) {
  const TempDir folder;
  std::vector<fs::path> paths;
  for (const int step : {100, 20, 3})
    paths.push_back(cube(folder / "",
                         "run_" +
                             std::string(step < 10    ? "00"
                                         : step < 100 ? "0"
                                                      : "") +
                             std::to_string(step),
                         2, char(step)));
  const auto datasets = open(paths);
  ASSERT_EQ(datasets.size(), 1u);
  EXPECT_EQ(datasets[0].times.count, 3u);
  EXPECT_THAT(datasets[0].times.values, ElementsAre(3, 20, 100));
  EXPECT_EQ(datasets[0].channels.size(), 1u);
  for (std::size_t time = 0; time < 3; ++time)
    EXPECT_EQ(loadVolume(datasets[0], 0, time, {})->channels()[0].histogram.maximum,
              datasets[0].times.values[time]);
}

TEST(Series, AreChannelsIfTheUserSaysSo) {
  const TempDir folder;
  std::vector<fs::path> paths;
  for (const char* stem : {"run_01", "run_02", "run_03"}) paths.push_back(cube(folder / "", stem, 2, 1));
  const auto datasets = open(paths, {.fourthAxis = FourthAxis::channel});
  ASSERT_EQ(datasets.size(), 1u);
  EXPECT_EQ(datasets[0].times.count, 1u);
  EXPECT_EQ(datasets[0].channels.size(), 3u);
}

TEST(Series, NeedThreeFilesOfOneGrid) {
  const TempDir folder;
  const auto two = open({cube(folder / "", "a_01", 2, 1), cube(folder / "", "a_02", 2, 1)});
  ASSERT_EQ(two.size(), 1u);
  EXPECT_EQ(two[0].times.count, 1u);
  EXPECT_EQ(two[0].channels.size(), 2u);
  const auto mixed = open({cube(folder / "", "b_01", 2, 1), cube(folder / "", "b_02", 3, 1),
                           cube(folder / "", "b_03", 2, 1), cube(folder / "", "b_04", 2, 1)});
  ASSERT_EQ(mixed.size(), 2u);
  EXPECT_EQ(mixed[0].times.count, 3u) << "the file of another grid is a data set of its own";
  EXPECT_EQ(mixed[1].times.count, 1u);
}

TEST(Folders, HoldTheVolumesBelowThem) {
  const TempDir folder;
  cube(folder / "series", "s10", 3, 1);
  cube(folder / "series", "s09", 3, 2);
  cube(folder / "series", "s11", 3, 3);
  cube(folder / "", "t1", 2, 1);
  cube(folder / "", "t2", 2, 1);
  cube(folder / ".hidden", "x", 2, 1);
  cube(folder / "deep/er", "y", 2, 1);
  writeBytes(folder / "notes.txt", "nothing to see");
  fs::create_directory_symlink(folder / "", folder / "loop");
  std::vector<std::string> warnings;
  const auto datasets =
      open({folder / ""}, {.warn = [&](const std::string& line) { warnings.push_back(line); }});
  EXPECT_THAT(titles(datasets), ElementsAre("t1.nrrd +1", "y.nrrd", "s09.nrrd"));
  EXPECT_EQ(datasets[2].times.count, 3u);
  EXPECT_THAT(warnings, ElementsAre());
}

TEST(Folders, LeaveOutWhatFailsWithAWarning) {
  const TempDir folder;
  cube(folder / "", "good", 2, 1);
  writeBytes(folder / "bad.nrrd", "NRRD0004\ntype: cheese\n\n");
  std::vector<std::string> warnings;
  const auto datasets =
      open({folder / ""}, {.warn = [&](const std::string& line) { warnings.push_back(line); }});
  EXPECT_THAT(titles(datasets), ElementsAre("good.nrrd"));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("bad.nrrd"));
  EXPECT_THAT(warnings[0], HasSubstr("; left out"));
}

TEST(Folders, JoinNoMoreChannelsThanAVolumeHolds) {
  const TempDir folder;
  for (int i = 0; i <= kMaxChannels; ++i)
    cube(folder / "", std::string("f") + char('A' + i / 26) + char('a' + i % 26), 2, 1);
  const auto datasets = open({folder / ""});
  ASSERT_EQ(datasets.size(), 2u);
  EXPECT_EQ(datasets[0].channels.size(), std::size_t(kMaxChannels));
  EXPECT_EQ(datasets[1].channels.size(), 1u);
}

TEST(Folders, WithoutVolumesAreRefused) {
  const TempDir folder;
  EXPECT_THAT(errorOf([&] { open({folder / ""}); }), HasSubstr("expected volume files in this folder"));
}

}  // namespace
}  // namespace scolopax::io
