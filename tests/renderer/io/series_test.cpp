// SPDX-License-Identifier: Apache-2.0
// Folders, and time series in several files.
#include "renderer/io/series.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>

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

/// A MetaImage of one voxel: data value = slope * 1 + intercept.
fs::path scaledVoxel(const fs::path& path, const std::string& scale) {
  return writeBytes(path, "ObjectType = Image\nNDims = 3\nDimSize = 1 1 1\nElementType = MET_UCHAR\n" +
                              scale + "ElementDataFile = LOCAL\n\x01");
}

TEST(Series, HaveOneScale) {
  const TempDir folder;
  const std::string half = "ElementToIntensityFunctionSlope = 0.5\n";
  const std::string less = "ElementToIntensityFunctionOffset = -1\n";
  for (const std::string& other : {half, less}) {
    const auto datasets = open({scaledVoxel(folder / "a_01.mha", ""), scaledVoxel(folder / "a_02.mha", other),
                                scaledVoxel(folder / "a_03.mha", ""), scaledVoxel(folder / "a_04.mha", "")});
    ASSERT_EQ(datasets.size(), 1u);
    ASSERT_EQ(datasets[0].sources.size(), 2u) << "one file is not a step";
    EXPECT_THAT(datasets[0].times.values, ElementsAre(1, 3, 4));
    EXPECT_EQ(datasets[0].files[1].filename(), "a_02.mha");
  }
}

/// A file of one step whose only channel has this unit.
std::shared_ptr<const VolumeFile> stepOfUnit(const std::string& name, const std::string& unit) {
  VolumeFile file{name};
  file.volumes = {{.levels = {Grid{}}, .channels = {{.name = "x", .unit = unit}}}};
  return std::make_shared<const VolumeFile>(std::move(file));
}

TEST(Series, HaveOneUnit) {
  const std::vector files{stepOfUnit("a_01.vti", "K"), stepOfUnit("a_02.vti", "K"),
                          stepOfUnit("a_03.vti", "degC"), stepOfUnit("a_04.vti", "K")};
  const auto joined = joinSeries(files);
  ASSERT_EQ(joined.size(), 2u);
  EXPECT_THAT(joined[0]->volumes[0].times.values, ElementsAre(1, 2, 4));
  EXPECT_EQ(joined[1], files[2]);
}

TEST(Series, HaveOneFileOfEachNumber) {
  std::vector<std::shared_ptr<const VolumeFile>> files;
  for (const char* name : {"run_01.vti", "run_001.vti", "run_02.vti", "run_03.vti"})
    files.push_back(stepOfUnit(name, ""));
  const auto joined = joinSeries(files);
  ASSERT_EQ(joined.size(), 2u);
  EXPECT_THAT(joined[0]->volumes[0].times.values, ElementsAre(1, 2, 3));
  EXPECT_EQ(joined[1], files[1]);
}

TEST(Series, OfTheSameTimesBecomeChannels) {
  const TempDir folder;
  std::vector<fs::path> paths;
  for (const char* stem : {"a_01", "a_02", "a_03", "b_01", "b_02", "b_03", "d_01", "d_02", "d_04"})
    paths.push_back(cube(folder / "", stem, 2, 1));
  const auto datasets = open(paths);
  ASSERT_EQ(datasets.size(), 2u);
  EXPECT_EQ(datasets[0].channels.size(), 2u);
  EXPECT_THAT(datasets[0].times.values, ElementsAre(1, 2, 3));
  EXPECT_THAT(datasets[1].times.values, ElementsAre(1, 2, 4));
}

TEST(Series, TakeTheTimesOfTheFirstThatTellsThem) {
  const TempDir folder;
  std::vector<fs::path> paths{writeBytes(folder / "untold.nrrd",
                                         "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 2 2 2 3\n"
                                         "kinds: domain domain domain time\nencoding: raw\n\n" +
                                             std::string(24, 'x'))};
  for (const char* stem : {"a_01", "a_02", "a_03", "d_01", "d_02", "d_04"})
    paths.push_back(cube(folder / "", stem, 2, 1));
  const auto datasets = open(paths);
  ASSERT_EQ(datasets.size(), 2u);
  EXPECT_THAT(datasets[0].times.values, ElementsAre(1, 2, 3));
  EXPECT_THAT(datasets[1].times.values, ElementsAre(1, 2, 4));
}

TEST(Series, MayHaveThousandsOfFiles) {
  const TempDir folder;
  constexpr int kFiles = 5000;  // to compare each with each other would take minutes
  std::vector<fs::path> paths;
  for (int i = 0; i < kFiles; ++i)
    paths.push_back(cube(folder / "", "run_" + std::to_string(10000 + i), 1, 1));
  const auto datasets = open(paths);
  ASSERT_EQ(datasets.size(), 1u);
  EXPECT_EQ(datasets[0].times.count, std::size_t(kFiles));
  EXPECT_EQ(datasets[0].sources.size(), 1u);
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

TEST(Folders, LeaveOutLinksThatLeadOutOfThem) {
  const TempDir outside, folder;
  const fs::path file = cube(outside / "", "secret", 2, 1);
  fs::create_directory(outside / "secret.zarr");
  writeBytes(outside / "secret.zarr/.zgroup", "{}");
  cube(folder / "deep", "a", 2, 1);
  fs::create_symlink(file, folder / "file.nrrd");
  fs::create_symlink(file, folder / "deep/file.nrrd");
  fs::create_directory_symlink(outside / "secret.zarr", folder / "claimed.zarr");
  fs::create_directory_symlink(outside / "", folder / "plain");
  fs::create_symlink(folder / "deep/a.nrrd", folder / "inside.nrrd");
  EXPECT_THAT(volumesIn(folder.path(), {}), ElementsAre(folder / "inside.nrrd", folder / "deep/a.nrrd"));
}

TEST(Folders, OfALinkAreThoseThatItLeadsTo) {
  const TempDir outside, folder;
  cube(outside / "", "a", 2, 1);
  fs::create_directory_symlink(outside.path(), folder / "link");
  EXPECT_THAT(volumesIn(folder / "link", {}), ElementsAre(folder / "link/a.nrrd"));
}

/// Takes the rights of the administrator, who may read everything, for a while.
class AsNobody {
 public:
  AsNobody() : own_(geteuid()) {
    if (own_ == 0 && seteuid(65534) != 0) throw std::runtime_error("no other user");
  }
  ~AsNobody() {
    if (own_ == 0 && seteuid(0) != 0) std::abort();
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;

 private:
  uid_t own_;
};

TEST(Folders, LeaveOutWhatCannotBeReadWithAWarning) {
  const TempDir folder;
  cube(folder / "shut", "x", 2, 1);
  cube(folder / "z", "y", 2, 1);
  const fs::path file = cube(folder / "", "closed", 2, 1);
  fs::permissions(folder.path(), fs::perms(0755));
  fs::permissions(folder / "shut", fs::perms::none);
  fs::permissions(file, fs::perms::none);
  std::vector<std::string> warnings;
  const auto warn = [&](const std::string& line) { warnings.push_back(line); };
  {
    const AsNobody nobody;
    EXPECT_THAT(volumesIn(folder.path(), {.warn = warn}), ElementsAre(folder / "z/y.nrrd"));
    EXPECT_THAT(errorOf([&] { volumesIn(folder / "shut", {}); }), HasSubstr("shut: Permission denied"));
  }
  EXPECT_THAT(warnings,
              testing::UnorderedElementsAre(testing::AllOf(HasSubstr("closed.nrrd"), HasSubstr("; left out")),
                                            testing::AllOf(HasSubstr("shut"), HasSubstr("; left out"))));
  fs::permissions(folder / "shut", fs::perms::owner_all);
}

TEST(Folders, WithoutVolumesAreRefused) {
  const TempDir folder;
  EXPECT_THAT(errorOf([&] { open({folder / ""}); }), HasSubstr("expected volume files in this folder"));
}

}  // namespace
}  // namespace scolopax::io
