// SPDX-License-Identifier: Apache-2.0
// Folders of DICOM files: series, order and grids of slices.
#include <gmock/gmock.h>

#include <numeric>

#include "tests/renderer/io/dicom_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class DicomFolders : public DicomTest {};

/// A slice of 2x1 pixels, `value` and value + 1, at this place along z.
DicomContents sliceAt(double z, int value) {
  return {.position = "0\\0\\" + std::to_string(z),
          .columns = 2,
          .rows = 1,
          .pixels = shorts({value, value + 1})};
}

/// Writes slices in a given order, with names that do not tell it.
void writeSlices(const TempDir& folder, const std::vector<DicomContents>& slices) {
  for (std::size_t i = 0; i < slices.size(); ++i)
    writeBytes(folder / ("file" + std::to_string((i * 7) % 10) + "_" + std::to_string(i)),
               dicomBytes(slices[i]));
}

std::vector<double> valuesOfFolder(const TempDir& folder, std::string* warnings = nullptr) {
  const auto warn = [=](const std::string& line) {
    if (warnings) *warnings += line + "\n";
  };
  return valuesOf(loadFile(folder.path(), kTestLimit, warn).channels[0]);
}

TEST_F(DicomFolders, AnObliqueSeriesIsWhatTheCollectionStates) {
  const auto path = dataFile("formats/dicom_series/t1_studyforrest");
  SKIP_WITHOUT(path);
  std::string warnings;
  const LoadedFile file = loadFile(path, kTestLimit, [&](const std::string& line) { warnings += line; });
  EXPECT_EQ(warnings, "");
  EXPECT_EQ(file.grid.dims, glm::ivec3(274, 384, 32));
  EXPECT_EQ(file.worldUnit, "mm");
  ASSERT_EQ(file.channels.size(), 1u);
  EXPECT_EQ(file.channels[0].name, "anat-T1w");
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::i16);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 179.0));
  // From the elements of N2D_0177.dcm and N2D_0208.dcm, which are the ends along the normal.
  const glm::dmat4 expected(
      glm::dvec4(-0.999032176441525, 0.0217883751691557, 0.0382096472372976, 0) * 0.699987828731537,
      glm::dvec4(-0.026519476938784, -0.991413870277297, -0.128043957939, 0) * 0.666666686534882,
      glm::dvec4(0.02339446822977075, -0.08595555674632245, 0.6606881352469367, 0),
      glm::dvec4(95.5670128416301, 144.932180715089, -26.2243754325923, 1));
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      EXPECT_NEAR(file.grid.worldFromVoxel[column][row], expected[column][row], 1e-9) << column << row;
  const auto values = valuesOf(file.channels[0]);
  const auto sliceSum = [&](std::ptrdiff_t z) {
    return std::accumulate(values.begin() + z * 274 * 384, values.begin() + (z + 1) * 274 * 384, 0.0);
  };
  EXPECT_EQ(sliceSum(0), 1175525);
  EXPECT_EQ(sliceSum(1), 1184921);
  EXPECT_EQ(sliceSum(31), 1833110);
  EXPECT_EQ(values[31 * 274 * 384 + 100 * 274 + 50], 31);
}

TEST_F(DicomFolders, UnevenSlicesOfTheCollectionAreRefusedWithTheirSteps) {
  const auto path = dataFile("formats/dicom_series/ct_ge_tilted");
  SKIP_WITHOUT(path);
  EXPECT_THAT(loadError(path), AllOf(HasSubstr("ct_ge_tilted"), HasSubstr("steps of 1.08, 4 and 7 mm"),
                                     HasSubstr("uneven grids cannot be shown")));
}

TEST_F(DicomFolders, SlicesAreSortedByPositionWhateverTheirNames) {
  const TempDir folder;
  writeSlices(folder, {sliceAt(6, 40), sliceAt(0, 10), sliceAt(4, 30), sliceAt(2, 20)});
  EXPECT_THAT(valuesOfFolder(folder), ElementsAre(10, 11, 20, 21, 30, 31, 40, 41));
  EXPECT_EQ(openFile(folder.path())->volumes[0].levels[0].worldFromVoxel,
            glm::dmat4(-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1));
}

TEST_F(DicomFolders, TheOrderIsThatAlongTheNormal) {
  const TempDir folder;
  std::vector<DicomContents> slices{sliceAt(0, 10), sliceAt(1, 20)};
  for (DicomContents& slice : slices) slice.orientation = "1\\0\\0\\0\\-1\\0";  // the normal is -z
  writeSlices(folder, slices);
  EXPECT_THAT(valuesOfFolder(folder), ElementsAre(20, 21, 10, 11));
  EXPECT_EQ(openFile(folder.path())->volumes[0].levels[0].worldFromVoxel,
            glm::dmat4(-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 1, 1));
}

TEST_F(DicomFolders, SeriesAndOrientationsAreVolumes) {
  const TempDir folder;
  std::vector<DicomContents> slices;
  for (int i = 0; i < 3; ++i) slices.push_back(sliceAt(i, 10 * i));
  for (DicomContents& slice : slices) slice.description = "T1/axial";
  DicomContents other = sliceAt(0, 70);
  other.series = "1.2.4", other.seriesNumber = "8";
  slices.push_back(other);
  DicomContents turned = slices[0];
  turned.orientation = "0\\1\\0\\0\\0\\-1";
  slices.push_back(turned);
  writeSlices(folder, slices);
  writeBytes(folder / "readme.txt", "no DICOM");
  const auto file = openFile(folder.path());
  std::vector<std::string> paths;
  for (const VolumeInfo& volume : file->volumes)
    paths.push_back(volume.path + " " + std::to_string(volume.levels[0].dims.z));
  EXPECT_THAT(paths, testing::UnorderedElementsAre("7 T1_axial 3", "7 T1_axial (2) 1", "8 1"));
}

TEST_F(DicomFolders, OfADirectoryHaveTheFilesInFoldersBelow) {
  const TempDir folder;
  writeBytes(folder / "DICOMDIR", "");
  std::filesystem::create_directories(folder / "a/b");
  writeBytes(folder / "a/b/one", dicomBytes(sliceAt(1, 20)));
  writeBytes(folder / "a/two", dicomBytes(sliceAt(0, 10)));
  EXPECT_THAT(valuesOfFolder(folder), ElementsAre(10, 11, 20, 21));
  EXPECT_EQ(openDatasets(std::vector{folder.path()}).size(), 1u);
}

TEST_F(DicomFolders, DamagedFilesAreLeftOutWithAWarning) {
  const TempDir folder;
  writeSlices(folder, {sliceAt(0, 10), sliceAt(1, 20)});
  writeBytes(folder / "bad.dcm", "no DICOM");
  std::string warnings;
  EXPECT_THAT(valuesOfFolder(folder, &warnings), ElementsAre(10, 11, 20, 21));
  EXPECT_THAT(warnings, AllOf(HasSubstr("bad.dcm"), HasSubstr("expected a DICOM file")));
  std::filesystem::remove_all(folder / "file0_0");
  std::filesystem::remove_all(folder / "file7_1");
  EXPECT_THAT(loadError(folder.path()), HasSubstr("bad.dcm"));
}

TEST_F(DicomFolders, OneHundredthOfUnevennessIsBorne) {
  const TempDir folder;
  writeSlices(folder, {sliceAt(0, 10), sliceAt(1, 20), sliceAt(2.015, 30)});
  EXPECT_THAT(valuesOfFolder(folder), ElementsAre(10, 11, 20, 21, 30, 31));
  EXPECT_NEAR(openFile(folder.path())->volumes[0].levels[0].worldFromVoxel[2][2], 2.015 / 2, 1e-12);
  writeBytes(folder / "file4_2", dicomBytes(sliceAt(2.03, 30)));
  EXPECT_THAT(loadError(folder.path()),
              HasSubstr("found steps of 1 and 1.03 mm; uneven grids cannot be shown"));
}

TEST_F(DicomFolders, MissingSlicesAreNamed) {
  const TempDir folder;
  writeSlices(folder, {sliceAt(0, 10), sliceAt(3, 20), sliceAt(6, 30), sliceAt(15, 40)});
  EXPECT_THAT(loadError(folder.path()), HasSubstr("found steps of 3 and 9 mm, as if 2 were missing"));
}

TEST_F(DicomFolders, DoubledSlicesAreLeftOut) {
  const TempDir folder;
  DicomContents second = sliceAt(1, 90);
  second.instance = "5";
  writeSlices(folder, {second, sliceAt(0, 10), sliceAt(1, 20), sliceAt(2, 30)});
  std::string warnings;
  EXPECT_THAT(valuesOfFolder(folder, &warnings), ElementsAre(10, 11, 20, 21, 30, 31));
  EXPECT_THAT(warnings, HasSubstr("1 slice lies where another does"));
}

TEST_F(DicomFolders, AsManySlicesAtEveryPositionAreTimes) {
  const TempDir folder;
  std::vector<DicomContents> slices;
  for (int time = 0; time < 2; ++time)
    for (int z = 0; z < 2; ++z) {
      slices.push_back(sliceAt(z, 100 * time + 10 * z));
      slices.back().instance = std::to_string(2 * time + z);
    }
  std::ranges::reverse(slices);
  writeSlices(folder, slices);
  const LoadedFile file = loadFile(folder.path(), kTestLimit, {}, 1);
  EXPECT_EQ(file.times.count, 2u);
  EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(100, 101, 110, 111));
  EXPECT_THAT(valuesOfFolder(folder), ElementsAre(0, 1, 10, 11));
}

TEST_F(DicomFolders, ATiltedGantryMakesAnObliqueGrid) {
  const TempDir folder;
  std::vector<DicomContents> slices;
  for (int i = 0; i < 3; ++i) {
    slices.push_back(sliceAt(4.0 * i, 10 * i));
    slices.back().position = "0\\" + std::to_string(3.0 * i) + "\\" + std::to_string(4.0 * i);
  }
  writeSlices(folder, slices);
  std::string warnings;
  EXPECT_THAT(valuesOfFolder(folder, &warnings), ElementsAre(0, 1, 10, 11, 20, 21));
  EXPECT_THAT(warnings, HasSubstr("by 36.9 degrees"));  // atan(3 / 4)
  EXPECT_EQ(openFile(folder.path())->volumes[0].levels[0].worldFromVoxel,
            glm::dmat4(-1, 0, 0, 0, 0, -1, 0, 0, 0, -3, 4, 0, 0, 0, 0, 1));
}

TEST_F(DicomFolders, SlicesBesideEachOtherAreRefused) {
  const TempDir folder;
  std::vector<DicomContents> slices{sliceAt(0, 0), sliceAt(1, 1), sliceAt(2, 2)};
  slices[1].position = "5\\0\\1";
  writeSlices(folder, slices);
  EXPECT_THAT(loadError(folder.path()), HasSubstr("found one 5 mm beside it"));
}

TEST_F(DicomFolders, SlicesOfDifferentScalesBecomeDataValues) {
  const TempDir folder;
  std::vector<DicomContents> slices{sliceAt(0, 10), sliceAt(1, 10)};
  slices[0].slope = "0.5", slices[0].intercept = "1";
  slices[1].slope = "0.25", slices[1].intercept = "-2";
  writeSlices(folder, slices);
  const LoadedFile file = loadFile(folder.path(), kTestLimit, {});
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::f32);
  EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(6, 6.5, 0.5, 0.75));
}

TEST_F(DicomFolders, SignedAndUnsignedSlicesGoTogether) {
  const TempDir folder;
  std::vector<DicomContents> slices{sliceAt(0, -5), sliceAt(1, -5)};
  slices[0].isSigned = 1;
  writeSlices(folder, slices);
  EXPECT_THAT(valuesOfFolder(folder), ElementsAre(-5, -4, 65531, 65532));
}

TEST_F(DicomFolders, SlicesWithoutPositionsAreInTheOrderOfTheirNumbers) {
  const TempDir folder;
  std::vector<DicomContents> slices{sliceAt(0, 30), sliceAt(0, 10), sliceAt(0, 20)};
  const std::vector<std::string> numbers{"10", "2", "9"};
  for (std::size_t i = 0; i < 3; ++i) {
    slices[i].position = slices[i].orientation = "";
    slices[i].instance = numbers[i];
    slices[i].thickness = "2.5";
  }
  writeSlices(folder, slices);
  std::string warnings;
  EXPECT_THAT(valuesOfFolder(folder, &warnings), ElementsAre(10, 11, 20, 21, 30, 31));
  EXPECT_THAT(warnings, HasSubstr("have no positions"));
  EXPECT_EQ(openFile(folder.path())->volumes[0].levels[0].spacing(), glm::dvec3(1, 1, 2.5));
}

TEST_F(DicomFolders, ACtWindowIsThatOfTheMiddleSlice) {
  const TempDir folder;
  std::vector<DicomContents> slices{sliceAt(0, 0), sliceAt(1, 0), sliceAt(2, 0)};
  for (int i = 0; i < 3; ++i) {
    slices[std::size_t(i)].modality = "CT";
    slices[std::size_t(i)].center = std::to_string(40 + i) + "\\500";
    slices[std::size_t(i)].width = "401\\2000";
  }
  writeSlices(folder, slices);
  const auto file = openFile(folder.path());
  const ChannelInfo& channel = file->volumes[0].channels[0];
  EXPECT_EQ(channel.unit, "HU");
  ASSERT_TRUE(channel.look.window);
  EXPECT_EQ(channel.look.window->lo, 41 - 0.5 - 200);
  EXPECT_EQ(channel.look.window->hi, 41 - 0.5 + 200);
}

/// A NRRD of one voxel.
void writeVoxel(const std::filesystem::path& path) {
  writeBytes(path, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\nx");
}

/// Two slices in a folder below.
void writeSeriesIn(const std::filesystem::path& folder, int value, const char* ending = "") {
  std::filesystem::create_directories(folder);
  for (int z = 0; z < 2; ++z)
    writeBytes(folder / ("slice" + std::to_string(z) + ending), dicomBytes(sliceAt(z, value + 10 * z)));
}

std::vector<std::string> datasetsOf(const std::filesystem::path& folder,
                                    std::vector<std::string>* warnings = nullptr) {
  const auto warn = [=](const std::string& line) {
    if (warnings) warnings->push_back(line);
  };
  std::vector<std::string> all;
  for (const Dataset& dataset : openDatasets(std::vector{folder}, {.warn = warn}))
    all.push_back(dataset.title + " " + std::to_string(dataset.levels[0].dims.z));
  return all;
}

TEST_F(DicomFolders, LeaveOtherFilesToTheirFormats) {
  const TempDir folder;
  writeSeriesIn(folder / "mixed", 10, ".dcm");
  writeVoxel(folder / "mixed/a.nrrd");
  std::filesystem::create_directory(folder / "mixed/below");
  writeVoxel(folder / "mixed/below/b.nrrd");
  for (const auto& named : {folder.path(), folder / "mixed"})
    EXPECT_THAT(datasetsOf(named), ElementsAre("mixed 2", "a.nrrd 1", "b.nrrd 1"));
}

TEST_F(DicomFolders, BelowAFolderAreFilesOfTheirOwn) {
  const TempDir folder;
  writeSeriesIn(folder / "first", 10);
  writeSeriesIn(folder / "deep/second", 50);
  writeBytes(folder / "deep/second/third", dicomBytes(sliceAt(2, 90)));
  writeVoxel(folder / "a.nrrd");
  EXPECT_EQ(findFormat(folder.path()), nullptr);
  EXPECT_THAT(datasetsOf(folder.path()), ElementsAre("a.nrrd 1", "second 3", "first 2"));
}

TEST_F(DicomFolders, ThatAreNamedFailWithTheirError) {
  const TempDir folder;
  writeSlices(folder, {sliceAt(0, 10), sliceAt(1, 20), sliceAt(5, 30)});
  EXPECT_THAT(errorOf([&] { datasetsOf(folder.path()); }), HasSubstr("uneven grids cannot be shown"));
  writeVoxel(folder / "a.nrrd");
  std::vector<std::string> warnings;
  EXPECT_THAT(datasetsOf(folder.path(), &warnings), ElementsAre("a.nrrd 1"));
  EXPECT_THAT(warnings, testing::Contains(HasSubstr("; left out")));
}

}  // namespace
}  // namespace scolopax::io
