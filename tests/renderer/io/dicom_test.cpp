// SPDX-License-Identifier: Apache-2.0
// Single DICOM files. Values of the collection's files were taken from their bytes by a script, or are those
// that a second program or the same file in another encoding gives.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>

#include <numeric>

#include "tests/renderer/io/dicom_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class DicomFiles : public DicomTest {};

LoadedFile loadDicom(const std::string& name) {
  return loadFile(dataFile("formats/dicom/" + name), kTestLimit, {});
}

double sumOf(const ChannelSource& channel) {
  const auto values = valuesOf(channel);
  return std::accumulate(values.begin(), values.end(), 0.0);
}

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

TEST_F(DicomFiles, ACtSliceHasItsGridAndHounsfieldUnits) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  const LoadedFile file = loadDicom("pydicom_CT_small.dcm");
  EXPECT_EQ(file.grid.dims, glm::ivec3(128, 128, 1));
  EXPECT_EQ(file.worldUnit, "mm");
  EXPECT_EQ(file.grid.worldFromVoxel, glm::dmat4(-0.661468, 0, 0, 0, 0, -0.661468, 0, 0, 0, 0, 5, 0,
                                                 158.135803, 179.035797, -75.699997, 1));
  ASSERT_EQ(file.channels.size(), 1u);
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::i16);
  EXPECT_EQ(file.channels[0].unit, "HU");
  EXPECT_EQ(file.channels[0].name, "pydicom_CT_small");
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(128.0 - 1024, 2191.0 - 1024));
  EXPECT_EQ(file.channels[0].voxels.as<std::int16_t>()[0], 175);
  EXPECT_EQ(sumOf(file.channels[0]), 14826310.0 - 1024 * 128 * 128);
}

TEST_F(DicomFiles, OneSliceIsTheSameInEveryEncoding) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  for (const char* encoding :
       {"", "_RLE", "_bigendian", "_implicit", "_jp2klossless", "_jpeg_ls_lossless", "_padded"}) {
    SCOPED_TRACE(encoding);
    const LoadedFile file = loadDicom("pydicom_MR_small" + std::string(encoding) + ".dcm");
    EXPECT_EQ(file.grid.worldFromVoxel,
              glm::dmat4(-0.3125, 0, 0, 0, 0, -0.3125, 0, 0, 0, 0, 0.8, 0, 83.9063, 91.2, 6.6406, 1));
    EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::i16);
    EXPECT_EQ(rangeOf(file.channels[0]), std::pair(127.0, 2145.0));
    EXPECT_EQ(sumOf(file.channels[0]), 2125338.0);
    EXPECT_EQ(valuesOf(file.channels[0])[1], 1019);
    ASSERT_TRUE(file.channels[0].look.window);
    EXPECT_EQ(file.channels[0].look.window->lo, 600 - 0.5 - 1599.0 / 2);
    EXPECT_EQ(file.channels[0].look.window->hi, 600 - 0.5 + 1599.0 / 2);
    EXPECT_EQ(file.channels[0].unit, "");
  }
}

TEST_F(DicomFiles, AgreeWithAnotherReader) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  for (const char* name : {"pydicom_MR_small.dcm", "pydicom_MR_small_implicit.dcm"}) {
    SCOPED_TRACE(name);
    const LoadedFile file = loadDicom(name);
    const auto image = OIIO::ImageInput::open(dataFile("formats/dicom/" + std::string(name)).string());
    if (!image) GTEST_SKIP() << "OpenImageIO without DICOM: " << OIIO::geterror();
    const auto values = valuesOf(file.channels[0]);
    ASSERT_EQ(image->spec().format, OIIO::TypeDesc::UINT16);
    std::vector<std::uint16_t> pixels(values.size());
    ASSERT_TRUE(image->read_image(0, 0, 0, 1, OIIO::TypeDesc::UINT16, pixels.data()));
    for (std::size_t i = 0; i < values.size(); ++i)  // DCMTK shifts signed values
      ASSERT_EQ(values[i], pixels[i] - 32768) << i;
  }
}

TEST_F(DicomFiles, ColourPicturesAreThreeChannels) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  const LoadedFile file = loadDicom("pydicom_SC_rgb_rle_16bit_2frame.dcm");
  EXPECT_EQ(file.grid.dims, glm::ivec3(100, 100, 2));
  ASSERT_EQ(file.channels.size(), 3u);
  EXPECT_EQ(file.channels[0].name, "red");
  EXPECT_EQ(file.channels[2].name, "blue");
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u16);
  // "10 rows of (255,0,0), 10 rows of (255,128,128), ...": ImageComments. The second frame is the inverse.
  const auto at = [&](std::size_t voxel) {
    return std::array{valuesOf(file.channels[0])[voxel], valuesOf(file.channels[1])[voxel],
                      valuesOf(file.channels[2])[voxel]};
  };
  EXPECT_THAT(at(0), ElementsAre(65535, 0, 0));
  EXPECT_THAT(at(1000), ElementsAre(65535, 128 * 257, 128 * 257));
  EXPECT_THAT(at(10000), ElementsAre(0, 65535, 65535));
}

TEST_F(DicomFiles, ADeflatedPictureIsWhatItsBytesAre) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  const LoadedFile file = loadDicom("pydicom_image_dfl.dcm");
  EXPECT_EQ(file.grid.dims, glm::ivec3(512, 512, 1));
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u8);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 255.0));
  EXPECT_EQ(sumOf(file.channels[0]), 33322688);
  EXPECT_EQ(valuesOf(file.channels[0])[0], 213);
}

TEST_F(DicomFiles, DosesLieOnTheirOffsetsAndAreScaled) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  for (const char* name : {"pydicom_rtdose.dcm", "pydicom_rtdose_rle.dcm"}) {
    SCOPED_TRACE(name);
    const LoadedFile file = loadDicom(name);
    EXPECT_EQ(file.grid.dims, glm::ivec3(10, 10, 15));
    EXPECT_EQ(file.grid.spacing(), glm::dvec3(10, 10, 5));
    EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(-189.43125, -199.43125, -761.87));
    const auto values = valuesOf(file.channels[0]);
    EXPECT_EQ(values.front(), 1249000 * 1e-6);
    EXPECT_EQ(values.back(), 799000 * 1e-6);
    EXPECT_EQ(rangeOf(file.channels[0]), std::pair(795000 * 1e-6, 1254000 * 1e-6));
  }
}

TEST_F(DicomFiles, ASegmentIsALabelChannel) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  const LoadedFile file = loadDicom("pydicom_liver_1frame.dcm");
  EXPECT_EQ(file.grid.dims, glm::ivec3(512, 512, 1));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(0.810547, 0.810547, 1));
  EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(235.2, 226.8, -128.69));
  ASSERT_EQ(file.channels.size(), 1u);
  EXPECT_EQ(file.channels[0].name, "Liver");
  EXPECT_TRUE(file.channels[0].look.labels);
  EXPECT_EQ(sumOf(file.channels[0]), 36233);
  const auto values = valuesOf(file.channels[0]);
  EXPECT_EQ(std::ranges::find(values, 1.0) - values.begin(), 74494);
}

TEST_F(DicomFiles, BadFilesOfTheCollectionAreRefusedInOneLine) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  const auto errorOfFile = [](const std::string& name) {
    return loadError(dataFile("formats/dicom/" + name));
  };
  EXPECT_THAT(errorOfFile("pydicom_MR_truncated.dcm"),
              HasSubstr("PixelData: expected 8192 bytes, the file holds at most 8130"));
  EXPECT_THAT(errorOfFile("pydicom_badVR.dcm"),
              HasSubstr("NumberOfFrames: expected 1 or more, found \"1A\""));
  EXPECT_THAT(errorOfFile("pydicom_no_meta.dcm"), HasSubstr("expected a DICOM file"));
  EXPECT_THAT(errorOfFile("pydicom_ExplVR_LitEndNoMeta.dcm"), HasSubstr("without Rows and Columns"));
  EXPECT_THAT(errorOfFile("pydicom_meta_missing_tsyntax.dcm"), HasSubstr("expected a DICOM file"));
  EXPECT_THAT(errorOfFile("DICOM_Stack.zip"), HasSubstr("unpack it"));
}

TEST_F(DicomFiles, IntegersOfEveryWidthLoad) {
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

TEST_F(DicomFiles, BitsBeyondTheStoredOnesAreCutOff) {
  const TempDir folder;
  const std::string pixels = shorts({0x7fff, 0x1001, 0x0800, 0x0fff, 0, 1});
  DicomContents contents{.bitsStored = 12, .pixels = pixels};
  EXPECT_THAT(valuesOf(loadContents(folder, contents).channels[0]), ElementsAre(4095, 1, 2048, 4095, 0, 1));
  contents.isSigned = 1;
  EXPECT_THAT(valuesOf(loadContents(folder, contents).channels[0]), ElementsAre(-1, 1, -2048, -1, 0, 1));
}

TEST_F(DicomFiles, SamplesAreInterleavedOrPlanes) {
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

TEST_F(DicomFiles, YbrBecomesRgb) {
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

TEST_F(DicomFiles, JpegPicturesAreDecodedToRgb) {
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

TEST_F(DicomFiles, DeflatedFilesMadeHereLoad) {
  const TempDir folder;
  DicomContents contents = kSixShorts;
  contents.syntax = kDeflated;
  EXPECT_THAT(valuesOf(loadContents(folder, contents).channels[0]), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(DicomFiles, WhatIsNotAppliedIsTold) {
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

TEST_F(DicomFiles, AxesAreThoseOfThePatientInRas) {
  const TempDir folder;
  DicomContents contents = kSixShorts;
  contents.position = "10\\20\\30";
  contents.orientation = "0\\1\\0\\0\\0\\-1";  // columns lie to the back, rows to the feet: sagittal
  contents.spacing = "2\\3";                   // between rows, between columns
  contents.sliceSpacing = "4";
  EXPECT_EQ(loadContents(folder, contents).grid.worldFromVoxel,
            glm::dmat4(0, -3, 0, 0, 0, 0, -2, 0, 4, 0, 0, 0, -10, -20, 30, 1));
}

TEST_F(DicomFiles, FramesWithATimeAreTimes) {
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

TEST_F(DicomFiles, FalseHeadersAreRefusedInOneLine) {
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
  EXPECT_THAT(with([](auto& c) { c.orientation = "1\\0\\0\\1\\0\\0"; }), HasSubstr("at right angles"));
  EXPECT_THAT(with([](auto& c) { c.spacing = "0\\1"; }),
              HasSubstr("PixelSpacing: expected two positive numbers"));
  EXPECT_THAT(with([](auto& c) { c.slope = "0"; }), HasSubstr("RescaleSlope"));
  EXPECT_THAT(with([](auto& c) { c.syntax = "1.2.840.10008.1.2.4.100"; }), HasSubstr("transfer syntax"));
  EXPECT_THAT(with([](auto& c) { c.sopClass = "1.2.840.10008.5.1.4.1.1.77.1.6"; }),
              HasSubstr("whole slides"));
  EXPECT_THAT(with([](auto& c) { c.samples = 3, c.columns = 1, c.photometric = "YBR_FULL_422"; }),
              HasSubstr("only if they are compressed"));
  EXPECT_THAT(with([](auto& c) { c.syntax = kRle, c.pixelElement = dicomFragments({"no RLE"}); }),
              testing::AnyOf(HasSubstr("a.dcm: PixelData"), HasSubstr("a.dcm: is damaged")));
}

TEST_F(DicomFiles, NamesOfPatientsAreNowhere) {
  const TempDir folder;
  std::string warnings;
  DicomContents contents = kSixShorts;
  contents.description = "head";
  const LoadedFile file = loadContents(folder, contents, &warnings);
  EXPECT_EQ(file.channels[0].name, "head");
  EXPECT_THAT(warnings + file.channels[0].name, testing::Not(HasSubstr("Secret")));
}

TEST_F(DicomFiles, EveryTruncationIsRefused) {
  const TempDir folder;
  const std::string bytes = dicomBytes(kSixShorts);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_NE(loadError(writeBytes(folder / "a.dcm", bytes.substr(0, size))), "") << size;
}

}  // namespace
}  // namespace scolopax::io
