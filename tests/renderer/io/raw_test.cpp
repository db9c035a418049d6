// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::HasSubstr;

const char* const kTypes[] = {"FLOAT16", "FLOAT32", "FLOAT64", "INT16", "INT32", "INT64",
                              "UINT16",  "UINT32",  "UINT64",  "INT8",  "UINT8"};

/// "testdata.INT16.BigEndian", ...: 20 of them.
std::vector<std::string> dataStems() {
  std::vector<std::string> stems;
  for (const std::string type : kTypes) {
    if (type.ends_with("INT8"))
      stems.push_back("testdata." + type);
    else
      for (const char* order : {".BigEndian", ".LittleEndian"}) stems.push_back("testdata." + type + order);
  }
  return stems;
}

/// The type in memory for a file's type when every value is between 0 and 19.
ScalarType keptTypeOf(const std::string& stem) {
  const auto has = [&](const char* text) { return stem.find(text) != std::string::npos; };
  if (has(".FLOAT") || has("INT64")) return ScalarType::f32;
  if (has(".UINT8")) return ScalarType::u8;
  if (has(".UINT16")) return ScalarType::u16;
  return ScalarType::i16;
}

TEST(RawFiles, EveryTypeAndByteOrderOfTheSidecarsHasExactlyItsVoxels) {
  SKIP_WITHOUT(dataFile("formats/raw_all_dtypes"));
  ASSERT_EQ(dataStems().size(), 20u);
  for (const std::string& stem : dataStems()) {
    for (const char* ending : {".dat", ".ivf"}) {
      SCOPED_TRACE(stem + ending);
      std::vector<std::string> warnings;
      const LoadedFile file = loadFile(dataFile("formats/raw_all_dtypes/" + stem + ending), kTestLimit,
                                       [&](const std::string& text) { warnings.push_back(text); });
      EXPECT_EQ(file.grid.dims, glm::ivec3(13, 7, 3));
      EXPECT_EQ(file.grid.worldFromVoxel, glm::dmat4(1.0));
      ASSERT_EQ(file.channels.size(), 1u);
      EXPECT_EQ(file.channels[0].name, stem);
      EXPECT_EQ(file.channels[0].voxels.type(), keptTypeOf(stem));
      const bool native = stem.find("UINT8") != stem.npos || stem.find("INT16") != stem.npos ||
                          stem.find("FLOAT32") != stem.npos;
      EXPECT_EQ(warnings.size(), native ? 0u : 1u);
      const auto values = valuesOf(file.channels[0]);
      std::size_t at = 0;
      for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 7; ++y)
          for (int x = 0; x < 13; ++x) ASSERT_EQ(values[at++], x + y + z);
    }
  }
}

TEST(RawFiles, TheNameGivesDimsAndTypeAndXIsFastest) {
  const TempDir folder;
  std::vector<std::int16_t> voxels(4 * 3 * 2);
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = std::int16_t(int(i) * 100 - 1000);
  const auto path = writeBytes(folder / "two_parts_4x3x2_int16.raw", bytesOf(voxels));
  const LoadedFile file = loadFile(path, kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(4, 3, 2));
  ASSERT_EQ(file.channels[0].voxels.type(), ScalarType::i16);
  EXPECT_TRUE(std::ranges::equal(file.channels[0].voxels.as<std::int16_t>(), voxels));

  const auto packed = writeBytes(folder / "packed_4x3x2_int16.raw.gz", gzipped(bytesOf(voxels)));
  const LoadedFile unpacked = loadFile(packed, kTestLimit, {});
  EXPECT_TRUE(std::ranges::equal(unpacked.channels[0].voxels.as<std::int16_t>(), voxels));
}

TEST(RawFiles, PlainVoxelsThatStartLikeGzipAreNotUnpacked) {
  const TempDir folder;
  const std::vector<std::uint16_t> voxels{0x8B1F, 8, 0, 0};
  const auto path = writeBytes(folder / "a_2x2x1_uint16.raw", bytesOf(voxels));
  EXPECT_EQ(valuesOf(loadFile(path, kTestLimit, {}).channels[0])[0], 0x8B1F);
}

TEST(RawFiles, ScalarVolumesOfTheCollectionLoad) {
  SKIP_WITHOUT(dataFile("scalar"));
  const LoadedFile neghip = loadFile(dataFile("scalar/neghip_64x64x64_uint8.derived.raw"), kTestLimit, {});
  EXPECT_EQ(neghip.grid.dims, glm::ivec3(64));
  EXPECT_EQ(neghip.channels[0].voxels.type(), ScalarType::u8);
  EXPECT_EQ(rangeOf(neghip.channels[0]), std::pair(0.0, 255.0));
  // The sidecar names hydrogenatom.raw, but only hydrogenatom.raw.gz exists.
  const LoadedFile hydrogen = loadFile(dataFile("scalar/hydrogenatom.dat"), kTestLimit, {});
  EXPECT_EQ(hydrogen.grid.dims, glm::ivec3(128));
  EXPECT_EQ(rangeOf(hydrogen.channels[0]), std::pair(0.0, 250.0));
  EXPECT_THAT(loadError(dataFile("scalar/tooth.raw")), HasSubstr("name_XxYxZ_type.raw"));
}

TEST(RawFiles, TheSizeMustBeExact) {
  const TempDir folder;
  EXPECT_THAT(loadError(writeBytes(folder / "a_3x3x3_uint16.raw", std::string(53, 'x'))),
              HasSubstr("expected a data file of 54 bytes, found 53"));
  EXPECT_THAT(loadError(writeBytes(folder / "a_3x3x3_uint8.raw", std::string(28, 'x'))),
              HasSubstr("expected a data file of 27 bytes, found 28"));
  EXPECT_THAT(loadError(writeBytes(folder / "b_3x3x3_uint8.raw", "")), HasSubstr("found 0"));
  EXPECT_THAT(loadError(writeBytes(folder / "c_3x3x3_uint8.raw.gz", gzipped(std::string(28, 'x')))),
              HasSubstr("found more"));
  EXPECT_THAT(loadError(writeBytes(folder / "d_3x3x3_uint8.raw.gz", gzipped(std::string(26, 'x')))),
              HasSubstr("expected 27 bytes"));
}

TEST(RawFiles, NamesAndSizesThatLieAreRefusedBeforeMemoryIsTaken) {
  const TempDir folder;
  for (const char* name : {"a.raw", "a_3x3_uint8.raw", "a_3x3x3_uint7.raw", "a_3x3x3.raw",
                           "a_-3x3x3_uint8.raw", "_x_x__uint8.raw"}) {
    EXPECT_THAT(loadError(writeBytes(folder / name, std::string(27, 'x'))), HasSubstr("file name: expected"))
        << name;
  }
  for (const char* name :
       {"a_0x3x3_uint8.raw", "a_2147483648x1x1_uint8.raw", "a_2000000000x2000000000x2000000000_uint8.raw",
        "a_99999999999999999999x1x1_uint8.raw", "a_2000000x2000000x64_float64.raw",
        "a_200000x200000x600_uint8.raw.gz"}) {
    EXPECT_NE(loadError(writeBytes(folder / name, gzipped(std::string(27, 'x')))), "") << name;
  }
  EXPECT_THAT(loadError(writeBytes(folder / "a_10x10x10_float64.raw", std::string(8000, '\0')), 3999),
              HasSubstr("needs 4000 bytes of memory, the limit is 3999"));
}

TEST(RawFiles, SidecarKeysAreHonoured) {
  const TempDir folder;
  writeBytes(folder / "voxels.bin",
             std::string("skip") + bytesOf(std::vector<std::uint16_t>{1, 2, 0x1234}, true) + "rest");
  const auto path =
      writeBytes(folder / "a.dat",
                 "ObjectFileName:\tvoxels.bin\r\nResolution: 3 1 1\r\nSliceThickness: 0.5 1 2.25\r\n"
                 "Format: USHORT\r\nByteOffset: 4\r\nEndianness: big\r\nModality: CT");
  std::vector<std::string> warnings;
  const LoadedFile file =
      loadFile(path, kTestLimit, [&](const std::string& text) { warnings.push_back(text); });
  EXPECT_EQ(valuesOf(file.channels[0]), (std::vector<double>{1, 2, 0x1234}));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(0.5, 1, 2.25));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("modality: is not used"));
}

TEST(RawFiles, SidecarsNameDataOnlyInOrBelowTheirFolder) {
  const TempDir folder;
  std::filesystem::create_directories(folder / "in/below");
  writeBytes(folder / "secret.raw", "1");
  writeBytes(folder / "in/below/data.raw", "1");
  std::filesystem::create_symlink("../secret.raw", folder / "in/link.raw");
  std::filesystem::create_directory_symlink(folder.path(), folder / "in/up");
  const auto errorFor = [&](const std::string& name) {
    return loadError(
        writeBytes(folder / "in/a.dat", "ObjectFileName: " + name + "\nResolution: 1 1 1\nFormat: UCHAR\n"));
  };
  EXPECT_EQ(errorFor("below/data.raw"), "");
  EXPECT_EQ(errorFor("./below/data.raw"), "");
  for (const std::string& name :
       {std::string("../secret.raw"), (folder / "secret.raw").string(), std::string("link.raw"),
        std::string("up/secret.raw"), std::string("below/../../secret.raw"), std::string("/dev/zero")}) {
    EXPECT_THAT(errorFor(name), HasSubstr("ObjectFileName: expected a file in or below the header's folder"))
        << name;
  }
  EXPECT_THAT(errorFor("gone.raw"), HasSubstr("ObjectFileName: names \"gone.raw\", which is not in"));
  EXPECT_THAT(errorFor("below"), HasSubstr("found a folder"));
  EXPECT_THAT(
      loadError(writeBytes(folder / "in/a.ivf",
                           "<InviwoTreeData><RawFile content='../secret.raw'/><Format content='UINT8'/>"
                           "<Dimension x='1' y='1' z='1'/></InviwoTreeData>")),
      HasSubstr("RawFile: expected a file in or below"));
}

TEST(RawFiles, BadSidecarsNameTheFieldThatIsWrong) {
  const TempDir folder;
  writeBytes(folder / "v.raw", "12345678");
  const auto errorFor = [&](const std::string& text) {
    return loadError(writeBytes(folder / "a.dat", text));
  };
  const std::string good = "ObjectFileName: v.raw\nResolution: 2 2 2\nFormat: UCHAR\n";
  EXPECT_EQ(errorFor(good), "");
  EXPECT_THAT(errorFor(""), HasSubstr("Resolution: is missing"));
  EXPECT_THAT(errorFor(std::string(100, '\0')), HasSubstr("header: expected lines"));
  EXPECT_THAT(errorFor("ObjectFileName: v.raw\nResolution: 2 2\nFormat: UCHAR\n"),
              HasSubstr("Resolution: expected"));
  EXPECT_THAT(errorFor("ObjectFileName: v.raw\nResolution: 2 2 -2\nFormat: UCHAR\n"),
              HasSubstr("Resolution: expected"));
  EXPECT_THAT(errorFor("ObjectFileName: v.raw\nResolution: 2 2 2\nFormat: Vec3FLOAT32\n"),
              HasSubstr("Format: expected"));
  EXPECT_THAT(errorFor("Resolution: 2 2 2\nFormat: UCHAR\n"), HasSubstr("ObjectFileName: is missing"));
  EXPECT_THAT(errorFor(good + "ByteOffset: -1\n"), HasSubstr("ByteOffset: expected"));
  EXPECT_THAT(errorFor(good + "ByteOffset: 9223372036854775807\n"), HasSubstr("found 8"));
  EXPECT_THAT(errorFor(good + "SliceThickness: 1 nan 1\n"), HasSubstr("SliceThickness: expected"));
  EXPECT_THAT(errorFor(good + "SliceThickness: 1 0 1\n"), HasSubstr("SliceThickness: expected"));
  EXPECT_THAT(errorFor(good + "Format: UCHAR\n"), HasSubstr("expected every key once"));
  EXPECT_THAT(errorFor(good + std::string(2 << 20, '\n')), HasSubstr("at most 1 MiB"));
  EXPECT_THAT(loadError(writeBytes(folder / "a.ivf", "<InviwoTreeData><")), HasSubstr("expected XML"));
  EXPECT_THAT(loadError(writeBytes(folder / "b.ivf", "<Other/>")), HasSubstr("InviwoTreeData"));
  EXPECT_THAT(loadError(writeBytes(folder / "c.ivf", "<InviwoTreeData/>")),
              HasSubstr("Dimension: attribute"));
}

TEST(LoadFile, RefusesWhatIsNotARegularFileWithoutWaiting) {
  const TempDir folder;
  for (const char* ending : {".raw", ".dat", ".ivf", ".nii", ".nii.gz", ".nrrd", ".tif", ".what"}) {
    const auto pipe = folder / ("pipe" + std::string(ending));
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_THAT(loadError(pipe), HasSubstr("expected a regular file, found a pipe"));
    const auto directory = folder / ("folder" + std::string(ending));
    std::filesystem::create_directory(directory);
    EXPECT_THAT(loadError(directory), HasSubstr("expected a file, or a folder of one of"));
    EXPECT_THAT(loadError(folder / ("gone" + std::string(ending))), HasSubstr("no such file"));
  }
  EXPECT_THAT(loadError("/dev/zero"), HasSubstr("found a device"));
}

TEST(LoadFile, NamesTheKnownFormatsForAnUnknownOne) {
  const TempDir folder;
  EXPECT_THAT(loadError(writeBytes(folder / "a.xyz", "nothing")),
              testing::AllOf(HasSubstr("a.xyz: expected one of"), HasSubstr(".raw"), HasSubstr(".dat")));
}

}  // namespace
}  // namespace scolopax::io
