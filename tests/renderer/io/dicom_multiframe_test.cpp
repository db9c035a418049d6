// SPDX-License-Identifier: Apache-2.0
// DICOM files of many frames, each with functional groups that tell its place.
#include <gmock/gmock.h>

#include <numeric>

#include "tests/renderer/io/dicom_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class DicomMultiframe : public DicomTest {};

constexpr std::uint32_t kSharedGroups = 0x52009229, kFrameGroups = 0x52009230;

std::string positionGroup(const std::string& position) {
  return dicomSequence(0x00209113, {dicomElement(0x00200032, "DS", position)});
}
std::string orientationGroup(const std::string& orientation) {
  return dicomSequence(0x00209116, {dicomElement(0x00200037, "DS", orientation)});
}
std::string measuresGroup(const std::string& spacing, const std::string& sliceSpacing) {
  return dicomSequence(
      0x00289110, {dicomElement(0x00180088, "DS", sliceSpacing) + dicomElement(0x00280030, "DS", spacing)});
}
std::string rescaleGroup(const std::string& slope) {
  return dicomSequence(0x00289145,
                       {dicomElement(0x00281052, "DS", "0") + dicomElement(0x00281053, "DS", slope)});
}
std::string timeGroup(std::uint64_t index) {
  return dicomSequence(0x00209111, {dicomElement(0x00209128, "UL", littleEndian(index, 4))});
}
std::string segmentGroup(std::uint64_t number) {
  return dicomSequence(0x0062000a, {dicomShort(0x0062000b, number)});
}

/// A file of frames of 2x1 pixels: frame i has the values 10 i and 10 i + 1.
DicomContents framesOf(const std::vector<std::string>& groups, const std::string& shared = "") {
  DicomContents contents{.frames = std::to_string(groups.size()),
                         .position = "",
                         .orientation = "",
                         .spacing = "",
                         .columns = 2,
                         .rows = 1};
  for (int i = 0; i < int(groups.size()); ++i) contents.pixels += shorts({10 * i, 10 * i + 1});
  contents.others = dicomSequence(kSharedGroups, {orientationGroup("1\\0\\0\\0\\1\\0") +
                                                  measuresGroup("1\\2", "3") + shared}) +
                    dicomSequence(kFrameGroups, groups);
  return contents;
}
std::filesystem::path writeContents(const TempDir& folder, const DicomContents& contents) {
  return writeBytes(folder / "a.dcm", dicomBytes(contents));
}

TEST_F(DicomMultiframe, TheEnhancedFileOfTheCollectionIsAVolume) {
  const auto path = dataFile("formats/dicom/enhanced_multiframe.dcm");
  SKIP_WITHOUT(path);
  std::string warnings;
  const LoadedFile file = loadFile(path, kTestLimit, [&](const std::string& line) { warnings += line; });
  EXPECT_EQ(warnings, "");
  EXPECT_EQ(file.grid.dims, glm::ivec3(64, 64, 6));
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u16);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 1195.0));
  // The positions of the frames: -109.79\-58.4773\-5.40356 to -109.79\-58.4774\6.59644.
  EXPECT_NEAR(file.grid.spacing().x, 3.375, 1e-12);
  EXPECT_NEAR(file.grid.spacing().z, 2.4, 1e-6);
  EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(109.79, 58.4773, -5.40356));
  const auto values = valuesOf(file.channels[0]);
  const std::array<double, 6> sums{427833, 409660, 405716,
                                   410284, 411917, 429332};  // of the frames, as stored
  for (std::ptrdiff_t z = 0; z < 6; ++z)
    EXPECT_EQ(std::accumulate(values.begin() + z * 4096, values.begin() + (z + 1) * 4096, 0.0),
              sums[std::size_t(z)]);
  ASSERT_TRUE(file.channels[0].look.window);  // of the fourth frame: center 607, width 1305
  EXPECT_EQ(file.channels[0].look.window->lo, 607 - 0.5 - 652);
  EXPECT_EQ(file.channels[0].unit, "");
}

TEST_F(DicomMultiframe, FramesLieWhereTheirGroupsSay) {
  const TempDir folder;
  const auto path = writeContents(
      folder, framesOf({positionGroup("0\\0\\6"), positionGroup("0\\0\\0"), positionGroup("0\\0\\3")}));
  const LoadedFile file = loadFile(path, kTestLimit, {});
  EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(10, 11, 20, 21, 0, 1));
  EXPECT_EQ(file.grid.worldFromVoxel, glm::dmat4(-2, 0, 0, 0, 0, -1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1));
  EXPECT_EQ(file.worldUnit, "mm");
}

TEST_F(DicomMultiframe, FramesAtOnePlaceAreTimesByTheirIndex) {
  const TempDir folder;
  const std::string low = positionGroup("0\\0\\0"), high = positionGroup("0\\0\\3");
  const auto path = writeContents(
      folder, framesOf({low + timeGroup(2), high + timeGroup(2), low + timeGroup(1), high + timeGroup(1)}));
  const LoadedFile first = loadFile(path, kTestLimit, {});
  EXPECT_EQ(first.times.count, 2u);
  EXPECT_THAT(valuesOf(first.channels[0]), ElementsAre(20, 21, 30, 31));
  EXPECT_THAT(valuesOf(loadFile(path, kTestLimit, {}, 1).channels[0]), ElementsAre(0, 1, 10, 11));
}

TEST_F(DicomMultiframe, OrientationsOfOneFileAreVolumes) {
  const TempDir folder;
  const auto path =
      writeContents(folder, framesOf({positionGroup("0\\0\\0"), positionGroup("0\\0\\3"),
                                      positionGroup("0\\0\\0") + orientationGroup("0\\1\\0\\0\\0\\-1")}));
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_EQ(file->volumes[0].levels[0].dims.z, 2);
  EXPECT_EQ(file->volumes[1].levels[0].dims.z, 1);
  EXPECT_EQ(file->volumes[1].path, "7 (2)");
  const LoadedPart second = load(*file, {.volume = 1}, LoadOptions{});
  EXPECT_THAT(valuesOf(second.channels[0]), ElementsAre(20, 21));
}

TEST_F(DicomMultiframe, ScalesOfFramesAreApplied) {
  const TempDir folder;
  const auto different = writeContents(folder, framesOf({positionGroup("0\\0\\0") + rescaleGroup("2"),
                                                         positionGroup("0\\0\\3") + rescaleGroup("0.5")}));
  EXPECT_THAT(valuesOf(loadFile(different, kTestLimit, {}).channels[0]), ElementsAre(0, 2, 5, 5.5));
  const auto same = writeContents(
      folder, framesOf({positionGroup("0\\0\\0"), positionGroup("0\\0\\3")}, rescaleGroup("4")));
  const LoadedFile file = loadFile(same, kTestLimit, {});
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u16);
  EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(0, 4, 40, 44));
}

TEST_F(DicomMultiframe, GroupsMustBeAsManyAsFrames) {
  const TempDir folder;
  DicomContents contents = framesOf({positionGroup("0\\0\\0"), positionGroup("0\\0\\3")});
  contents.frames = "1";
  std::string warnings;
  loadFile(writeContents(folder, contents), kTestLimit, [&](const std::string& line) { warnings += line; });
  EXPECT_THAT(warnings, HasSubstr("2 functional groups for 1 frame"));
  contents.frames = "3";
  contents.pixels += shorts({7, 7});
  EXPECT_THAT(loadError(writeContents(folder, contents)),
              HasSubstr("PerFrameFunctionalGroupsSequence: expected 3 items, found 2"));
}

TEST_F(DicomMultiframe, SegmentsAreChannelsAndSlicesLeftOutAreEmpty) {
  const TempDir folder;
  DicomContents contents{.sopClass = "1.2.840.10008.5.1.4.1.1.66.4",
                         .modality = "SEG",
                         .frames = "3",
                         .position = "",
                         .orientation = "",
                         .spacing = "",
                         .columns = 4,
                         .rows = 2,
                         .bits = 1};
  const auto segment = [](std::uint64_t number, const std::string& name) {
    return dicomShort(0x00620004, number) + dicomElement(0x00620005, "LO", name);
  };
  contents.others =
      dicomElement(0x00620001, "CS", "BINARY") +
      dicomSequence(0x00620002, {segment(1, "Liver"), segment(5, "Spleen")}) +
      dicomSequence(kSharedGroups, {orientationGroup("1\\0\\0\\0\\1\\0") + measuresGroup("1\\1", "2")}) +
      dicomSequence(kFrameGroups,
                    {positionGroup("0\\0\\0") + segmentGroup(1), positionGroup("0\\0\\6") + segmentGroup(1),
                     positionGroup("0\\0\\2") + segmentGroup(5)});
  contents.pixels = "\x81\x0f\xff";
  const LoadedFile file = loadFile(writeContents(folder, contents), kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(4, 2, 4));
  EXPECT_EQ(file.grid.spacing().z, 2);
  ASSERT_EQ(file.channels.size(), 2u);
  EXPECT_EQ(file.channels[0].name, "Liver");
  EXPECT_EQ(file.channels[1].name, "Spleen");
  EXPECT_TRUE(file.channels[1].look.labels);
  std::vector<double> liver(32, 0.0), spleen(32, 0.0);
  liver[0] = liver[7] = 1;
  std::fill_n(liver.begin() + 24, 4, 1.0);
  std::fill_n(spleen.begin() + 8, 8, 1.0);
  EXPECT_EQ(valuesOf(file.channels[0]), liver);
  EXPECT_EQ(valuesOf(file.channels[1]), spleen);
  const auto opened = openFile(folder / "a.dcm");  // one channel alone
  EXPECT_EQ(valuesOf(load(*opened, {.channels = {1}}, LoadOptions{}).channels[0]), spleen);
}

TEST_F(DicomMultiframe, AFalseSegmentIsRefused) {
  const TempDir folder;
  DicomContents contents = framesOf({positionGroup("0\\0\\0") + segmentGroup(2)});
  contents.others = dicomElement(0x00620001, "CS", "BINARY") +
                    dicomSequence(0x00620002, {dicomShort(0x00620004, 1)}) + contents.others;
  EXPECT_THAT(loadError(writeContents(folder, contents)),
              HasSubstr("ReferencedSegmentNumber: expected one of SegmentSequence, found 2"));
}

}  // namespace
}  // namespace scolopax::io
