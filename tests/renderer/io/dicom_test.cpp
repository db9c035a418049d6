// SPDX-License-Identifier: Apache-2.0
// Single DICOM files. Values of the collection's files were taken from their bytes by a script, or are those
// that a second program or the same file in another encoding gives.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>

#include <numeric>

#include "tests/renderer/io/dicom_test_support.h"

namespace scolopax::io {
namespace {

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

TEST_F(DicomFiles, AFolderOfAllKindsGivesWhatCanBeShown) {
  SKIP_WITHOUT(dataFile("formats/dicom"));
  std::string warnings;
  const auto file =
      openFile(dataFile("formats/dicom"), {.warn = [&](const std::string& line) { warnings += line; }});
  EXPECT_THAT(warnings, HasSubstr("pydicom_ExplVR_LitEndNoMeta.dcm: expected pictures"));
  EXPECT_THAT(warnings, HasSubstr("2 more files cannot be read"));  // only three are named
  const auto enhanced = std::ranges::find(file->volumes, "6 REST1 w SMS PF7-8", &VolumeInfo::path);
  ASSERT_NE(enhanced, file->volumes.end());
  const LoadedPart part =
      load(*file, {.volume = std::size_t(enhanced - file->volumes.begin())}, LoadOptions{});
  EXPECT_EQ(part.grid.dims, glm::ivec3(64, 64, 6));
  EXPECT_EQ(rangeOf(part.channels[0]), std::pair(0.0, 1195.0));
}

}  // namespace
}  // namespace scolopax::io
