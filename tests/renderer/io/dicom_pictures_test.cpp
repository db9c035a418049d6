// SPDX-License-Identifier: Apache-2.0
// DICOM files made element by element: kinds of pixels, and headers that lie.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>

#include "tests/renderer/io/dicom_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class DicomPictures : public DicomTest {};

/// Loads a file made of the contents; its warnings are in `warnings`.
LoadedFile loadContents(const TempDir& folder, const DicomContents& contents,
                        std::string* warnings = nullptr) {
  return loadFile(writeBytes(folder / "a.dcm", dicomBytes(contents)), kTestLimit,
                  [=](const std::string& line) {
                    if (warnings) *warnings += line + "\n";
                  });
}
std::string contentsError(const TempDir& folder, const DicomContents& contents) {
  return loadError(writeBytes(folder / "a.dcm", dicomBytes(contents)));
}
const DicomContents kSixShorts{.pixels = shorts({1, 2, 3, 4, 5, 6})};

TEST_F(DicomPictures, IntegersOfEveryWidthLoad) {
  const TempDir folder;
  const auto check = [&]<class T>(T, int bits, ScalarType kept) {
    SCOPED_TRACE(bits);
    const T low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
    const bool isSigned = low < T(0);
    const LoadedFile file =
        loadContents(folder, {.bits = bits,
                              .isSigned = isSigned,
                              .slope = "2",
                              .intercept = "-10",
                              .pixels = bytesOf(std::vector<T>{low, high, 0, 1, 2, 100})});
    EXPECT_EQ(file.channels[0].voxels.type(), kept);
    EXPECT_THAT(valuesOf(file.channels[0]),
                ElementsAre(2.0 * low - 10, 2.0 * double(float(high)) - 10, -10, -8, -6, 190));
  };
  check(std::uint8_t(), 8, ScalarType::u8);
  check(std::int8_t(), 8, ScalarType::i16);
  check(std::uint16_t(), 16, ScalarType::u16);
  check(std::int16_t(), 16, ScalarType::i16);
  check(std::uint32_t(), 32, ScalarType::f32);
  check(std::int32_t(), 32, ScalarType::f32);
}

TEST_F(DicomPictures, BitsBeyondTheStoredOnesAreCutOff) {
  const TempDir folder;
  const std::string pixels = shorts({0x7fff, 0x1001, 0x0800, 0x0fff, 0, 1});
  DicomContents contents{.bitsStored = 12, .pixels = pixels};
  EXPECT_THAT(valuesOf(loadContents(folder, contents).channels[0]), ElementsAre(4095, 1, 2048, 4095, 0, 1));
  contents.isSigned = 1;
  EXPECT_THAT(valuesOf(loadContents(folder, contents).channels[0]), ElementsAre(-1, 1, -2048, -1, 0, 1));
}

TEST_F(DicomPictures, SamplesAreInterleavedOrPlanes) {
  const TempDir folder;
  DicomContents contents{.columns = 2, .rows = 1, .bits = 8, .samples = 3, .photometric = "RGB"};
  for (const int planar : {0, 1}) {
    contents.planar = planar;
    contents.pixels = planar ? "\x01\x04\x02\x05\x03\x06" : "\x01\x02\x03\x04\x05\x06";
    const LoadedFile file = loadContents(folder, contents);
    ASSERT_EQ(file.channels.size(), 3u);
    EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(1, 4));
    EXPECT_THAT(valuesOf(file.channels[1]), ElementsAre(2, 5));
    EXPECT_THAT(valuesOf(file.channels[2]), ElementsAre(3, 6));
  }
}

TEST_F(DicomPictures, YbrBecomesRgb) {
  const TempDir folder;
  // Red and blue as JFIF defines them.
  const LoadedFile file = loadContents(folder, {.columns = 2,
                                                .rows = 1,
                                                .bits = 8,
                                                .samples = 3,
                                                .photometric = "YBR_FULL",
                                                .pixels = "\x4c\x55\xff\x1d\xff\x6b"});
  EXPECT_THAT(valuesOf(file.channels[0]),
              ElementsAre(testing::DoubleNear(255, 1), testing::DoubleNear(0, 1)));
  EXPECT_THAT(valuesOf(file.channels[1]), ElementsAre(testing::DoubleNear(0, 1), testing::DoubleNear(0, 1)));
  EXPECT_THAT(valuesOf(file.channels[2]),
              ElementsAre(testing::DoubleNear(0, 1), testing::DoubleNear(255, 1)));
}

/// A JPEG file of one colour.
std::string jpegOf(const TempDir& folder, std::vector<std::uint8_t> color) {
  const std::string path = (folder / "a.jpg").string();
  const auto output = OIIO::ImageOutput::create(path);
  OIIO::ImageSpec spec(16, 16, int(color.size()), OIIO::TypeDesc::UINT8);
  std::vector<std::uint8_t> pixels;
  for (int i = 0; i < 256; ++i) pixels.insert(pixels.end(), color.begin(), color.end());
  output->open(path, spec);
  output->write_image(OIIO::TypeDesc::UINT8, pixels.data());
  output->close();
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_F(DicomPictures, JpegPicturesAreDecodedToRgb) {
  const TempDir folder;
  for (const char* photometric : {"YBR_FULL_422", "YBR_FULL"}) {
    SCOPED_TRACE(photometric);
    const LoadedFile file =
        loadContents(folder, {.syntax = kJpeg,
                              .columns = 16,
                              .rows = 16,
                              .bits = 8,
                              .samples = 3,
                              .photometric = photometric,
                              .pixelElement = dicomFragments({jpegOf(folder, {200, 100, 30})})});
    ASSERT_EQ(file.channels.size(), 3u);
    EXPECT_NEAR(valuesOf(file.channels[0])[40], 200, 3);
    EXPECT_NEAR(valuesOf(file.channels[1])[40], 100, 3);
    EXPECT_NEAR(valuesOf(file.channels[2])[40], 30, 3);
  }
  const LoadedFile gray =
      loadContents(folder, {.syntax = kJpeg,
                            .frames = "2",
                            .columns = 16,
                            .rows = 16,
                            .bits = 8,
                            .pixelElement = dicomFragments({jpegOf(folder, {77}), jpegOf(folder, {9})})});
  EXPECT_EQ(gray.grid.dims, glm::ivec3(16, 16, 2));
  EXPECT_NEAR(valuesOf(gray.channels[0])[40], 77, 1);
  EXPECT_NEAR(valuesOf(gray.channels[0])[296], 9, 1);
}

TEST_F(DicomPictures, DeflatedFilesMadeHereLoad) {
  const TempDir folder;
  DicomContents contents = kSixShorts;
  contents.syntax = kDeflated;
  EXPECT_THAT(valuesOf(loadContents(folder, contents).channels[0]), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(DicomPictures, WhatIsNotAppliedIsTold) {
  const TempDir folder;
  std::string warnings;
  DicomContents contents = kSixShorts;
  contents.photometric = "MONOCHROME1";
  EXPECT_THAT(valuesOf(loadContents(folder, contents, &warnings).channels[0]), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(warnings, HasSubstr("MONOCHROME1"));
  contents.photometric = "PALETTE COLOR";
  for (const std::uint32_t color : {1, 2, 3})
    contents.others += dicomElement(0x00281100 + color, "US", shorts({7, 0, 16}));
  for (const std::uint32_t color : {1, 2, 3})
    contents.others += dicomElement(0x00281200 + color, "OW", shorts({0, 1, 2, 3, 4, 5, 6}));
  loadContents(folder, contents, &warnings);
  EXPECT_THAT(warnings, HasSubstr("the palette is left out"));
  contents = kSixShorts;
  contents.spacing = "";
  EXPECT_EQ(loadContents(folder, contents, &warnings).worldUnit, "");
  EXPECT_THAT(warnings, HasSubstr("PixelSpacing: is missing, taken as 1"));
}

TEST_F(DicomPictures, AxesAreThoseOfThePatientInRas) {
  const TempDir folder;
  DicomContents contents = kSixShorts;
  contents.position = "10\\20\\30";
  contents.orientation = "0\\1\\0\\0\\0\\-1";  // columns lie to the back, rows to the feet: sagittal
  contents.spacing = "2\\3";                   // between rows, between columns
  contents.sliceSpacing = "4";
  EXPECT_EQ(loadContents(folder, contents).grid.worldFromVoxel,
            glm::dmat4(0, -3, 0, 0, 0, 0, -2, 0, 4, 0, 0, 0, -10, -20, 30, 1));
}

TEST_F(DicomPictures, FramesWithATimeAreTimes) {
  const TempDir folder;
  DicomContents contents{.frames = "3",
                         .position = "",
                         .orientation = "",
                         .columns = 2,
                         .rows = 1,
                         .pixels = shorts({1, 2, 3, 4, 5, 6})};
  contents.thickness = "";
  EXPECT_EQ(loadContents(folder, contents).grid.dims, glm::ivec3(2, 1, 3));
  contents.others = "";
  std::string bytes = dicomBytes(contents);
  const std::string before = dicomElement(0x0020000e, "UI", "1.2.3");
  bytes.insert(bytes.find(before), dicomElement(0x00181063, "DS", "40"));
  const LoadedFile file = loadFile(writeBytes(folder / "a.dcm", bytes), kTestLimit, {}, 2);
  EXPECT_EQ(file.grid.dims, glm::ivec3(2, 1, 1));
  EXPECT_THAT(file.times.values, ElementsAre(0, 0.04, 0.08));
  EXPECT_EQ(file.times.unit, "s");
  EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(5, 6));
}

TEST_F(DicomPictures, FalseHeadersAreRefusedInOneLine) {
  const TempDir folder;
  const auto with = [&](auto change) {
    DicomContents contents = kSixShorts;
    change(contents);
    return contentsError(folder, contents);
  };
  EXPECT_EQ(with([](auto&) {}), "");
  EXPECT_THAT(with([](auto& c) { c.rows = 65535, c.columns = 65535; }),
              HasSubstr("the file holds at most 12"));
  EXPECT_THAT(with([](auto& c) { c.frames = "2000000000"; }),
              AllOf(HasSubstr("NumberOfFrames"), HasSubstr("found")));
  EXPECT_THAT(with([](auto& c) { c.frames = "0"; }),
              HasSubstr("NumberOfFrames: expected 1 or more, found \"0\""));
  EXPECT_THAT(with([](auto& c) { c.rows = 0; }), HasSubstr("Rows: expected 1 to 65535, found 0"));
  EXPECT_THAT(with([](auto& c) { c.bits = 12; }),
              HasSubstr("BitsAllocated: expected 1, 8, 16 or 32, found 12"));
  EXPECT_THAT(with([](auto& c) { c.samples = 4; }), HasSubstr("SamplesPerPixel: expected 1 or 3, found 4"));
  EXPECT_THAT(with([](auto& c) { c.photometric = "CMYK"; }), HasSubstr("found \"CMYK\""));
  EXPECT_THAT(with([](auto& c) { c.position = "1\\2"; }),
              HasSubstr("ImagePositionPatient: expected 3 numbers"));
  EXPECT_THAT(with([](auto& c) { c.position = "1\\2\\nan"; }), HasSubstr("expected 3 numbers"));
  EXPECT_THAT(with([](auto& c) { c.position = "1e308\\-1e308\\0"; }), HasSubstr("at most 1e9 mm"));
  EXPECT_THAT(with([](auto& c) { c.orientation = "1\\0\\0\\1\\0\\0"; }), HasSubstr("at right angles"));
  EXPECT_THAT(with([](auto& c) { c.spacing = "0\\1"; }),
              HasSubstr("PixelSpacing: expected two positive numbers"));
  EXPECT_THAT(with([](auto& c) { c.slope = "0"; }), HasSubstr("RescaleSlope"));
  EXPECT_THAT(with([](auto& c) { c.syntax = "1.2.840.10008.1.2.4.100"; }),
              HasSubstr("TransferSyntaxUID: expected one that GDCM decodes"));
  EXPECT_THAT(with([](auto& c) { c.syntax = "1.2.840.10008.1.2.4.201"; }), HasSubstr("TransferSyntaxUID"));
  EXPECT_THAT(with([](auto& c) { c.sopClass = "1.2.840.10008.5.1.4.1.1.77.1.6"; }),
              HasSubstr("whole slides"));
  EXPECT_THAT(with([](auto& c) { c.samples = 3, c.columns = 1, c.photometric = "YBR_FULL_422"; }),
              HasSubstr("only if they are compressed"));
  EXPECT_THAT(with([](auto& c) { c.syntax = kRle, c.pixelElement = dicomFragments({"no RLE"}); }),
              testing::AnyOf(HasSubstr("a.dcm: PixelData"), HasSubstr("a.dcm: is damaged")));
}

TEST_F(DicomPictures, NamesOfPatientsAreNowhere) {
  const TempDir folder;
  std::string warnings;
  DicomContents contents = kSixShorts;
  contents.description = "head";
  const LoadedFile file = loadContents(folder, contents, &warnings);
  EXPECT_EQ(file.channels[0].name, "head");
  EXPECT_THAT(warnings + file.channels[0].name, testing::Not(HasSubstr("Secret")));
}

TEST_F(DicomPictures, TruncatedFilesAreRefused) {
  const TempDir folder;
  const std::string bytes = dicomBytes(kSixShorts);
  for (std::size_t size = 0; size < bytes.size(); size += size == 0 || size > bytes.size() - 30 ? 1 : 3) {
    if (size == 1) size = 120;  // the preamble may hold anything
    EXPECT_NE(loadError(writeBytes(folder / "a.dcm", bytes.substr(0, size))), "") << size;
  }
}

}  // namespace
}  // namespace scolopax::io
