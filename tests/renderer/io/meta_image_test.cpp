// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <numeric>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The numbers first, first + step, ... as 16-bit little-endian voxels.
std::string metaRamp(int count, int first = 0, int step = 1, bool reversed = false) {
  std::vector<std::uint16_t> values;
  for (int i = 0; i < count; ++i) values.push_back(std::uint16_t(first + i * step));
  return bytesOf(values, reversed);
}
std::vector<double> metaNumbers(int first, int count, int step = 1) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(first + i * step);
  return values;
}
std::string metaZlib(std::string_view bytes) {
  std::string packed(compressBound(bytes.size()), '\0');
  uLongf size = packed.size();
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
            bytes.size(), 9);
  packed.resize(size);
  return packed;
}

const std::string kMeta = "ObjectType = Image\nNDims = 3\nDimSize = 2 3 2\nElementType = MET_USHORT\n";

LoadedFile loadMeta(const TempDir& folder, const std::string& fields,
                    const std::string& dataFile = "LOCAL\n" + metaRamp(12), const Warn& warn = {},
                    std::size_t time = 0, FourthAxis fourthAxis = FourthAxis::automatic) {
  const auto path = writeBytes(folder / "a.mha", fields + "ElementDataFile = " + dataFile);
  return loadFile(path, kTestLimit, warn, time, fourthAxis);
}
std::string metaError(const TempDir& folder, const std::string& fields,
                      const std::string& dataFile = "LOCAL\n" + metaRamp(12)) {
  return errorOf([&] { loadMeta(folder, fields, dataFile); });
}

TEST(MetaImageFiles, TheBrainIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("formats/metaimage/mha.mha"));
  std::vector<std::string> warnings;
  const LoadedFile file = loadFile(dataFile("formats/metaimage/mha.mha"), kTestLimit,
                                   [&](const std::string& line) { warnings.push_back(line); });
  EXPECT_EQ(file.grid.dims, glm::ivec3(64, 64, 37));
  ASSERT_EQ(file.channels.size(), 1u);
  EXPECT_EQ(file.channels[0].name, "mha");
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::i16);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 6690.0));
  const auto values = valuesOf(file.channels[0]);  // sum and voxel by Python's zlib and struct
  EXPECT_EQ(std::accumulate(values.begin(), values.end(), 0.0), 79944614.0);
  EXPECT_EQ(values[64 * 64 * 18 + 64 * 32 + 30], 1805);
  EXPECT_EQ(file.worldUnit, "mm");
  const glm::dmat4& m = file.grid.worldFromVoxel;  // LPS with y reversed, in RAS
  EXPECT_EQ(glm::dvec3(m[0]), glm::dvec3(-3.4375000000000009, 0, 0));
  EXPECT_EQ(glm::dvec3(m[1]), glm::dvec3(0, 3.4375000000000009, 0));
  EXPECT_EQ(glm::dvec3(m[2]), glm::dvec3(0, 0, 3.7999999999999994));
  EXPECT_EQ(glm::dvec3(m[3]), glm::dvec3(108.28100000000002, -82.379500000000007, -47.835599999999992));
  EXPECT_TRUE(warnings.empty()) << warnings[0];
}

TEST(MetaImageFiles, TheHeadIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("formats/metaimage/HeadMRVolume.mhd"));
  const auto path = dataFile("formats/metaimage/HeadMRVolume.mhd");
  const LoadedFile file = loadFile(path, kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(48, 62, 42));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(4));
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u8);
  const auto values = valuesOf(file.channels[0]);
  EXPECT_EQ(std::accumulate(values.begin(), values.end(), 0.0), 3058332.0);  // of the .raw file's bytes
  EXPECT_EQ(values[48 * 62 * 21 + 48 * 31 + 20], 52);
  EXPECT_THAT(openFile(path)->dataFiles, ElementsAre(dataFile("formats/metaimage/HeadMRVolume.raw")));
}

TEST(MetaImageFiles, EveryTypeAndByteOrderLoads) {
  const TempDir folder;
  const auto check = [&]<class T>(const std::string& name, T) {
    SCOPED_TRACE(name);
    const std::vector<T> stored{T(1), T(100), T(7), T(0)};
    for (const bool big : {false, true}) {
      const std::string order = big ? "ElementByteOrderMSB = True\n" : "BinaryDataByteOrderMSB = False\n";
      const LoadedFile file =
          loadMeta(folder, "NDims = 3\nDimSize = 2 2 1\nElementType = " + name + "\n" + order,
                   "Local\n" + bytesOf(stored, big));
      EXPECT_THAT(valuesOf(file.channels[0]), ElementsAre(1, 100, 7, 0));
    }
  };
  check("MET_CHAR", std::int8_t());
  check("MET_UCHAR", std::uint8_t());
  check("MET_SHORT", std::int16_t());
  check("MET_USHORT", std::uint16_t());
  check("MET_INT", std::int32_t());
  check("MET_UINT", std::uint32_t());
  check("MET_LONG", std::int32_t());
  check("MET_ULONG", std::uint32_t());
  check("MET_LONG_LONG", std::int64_t());
  check("MET_ULONG_LONG", std::uint64_t());
  check("MET_FLOAT", float());
  check("MET_DOUBLE", double());
}

TEST(MetaImageFiles, DataAreLocalOrInOneFilePackedOrNot) {
  const TempDir folder;
  const auto values = [&](const std::string& fields, const std::string& dataFile) {
    return valuesOf(loadMeta(folder, kMeta + fields, dataFile).channels[0]);
  };
  const auto ramp = metaNumbers(0, 12);
  writeBytes(folder / "with blanks.raw", metaRamp(12));
  writeBytes(folder / "later.raw", "12345" + metaRamp(12));
  writeBytes(folder / "a.zraw", metaZlib(metaRamp(12)));
  writeBytes(folder / "a.gz", gzipped(metaRamp(12)));
  EXPECT_EQ(values("", "LOCAL\n" + metaRamp(12)), ramp);
  EXPECT_EQ(values("", "local\r\n" + metaRamp(12)), ramp);
  EXPECT_EQ(values("", "with blanks.raw\n"), ramp);
  EXPECT_EQ(values("", "with blanks.raw"), ramp);
  EXPECT_EQ(values("HeaderSize = 5\n", "later.raw"), ramp);
  EXPECT_EQ(values("HeaderSize = -1\n", "later.raw"), ramp);
  EXPECT_EQ(values("CompressedData = True\n", "a.zraw"), ramp);
  EXPECT_EQ(values("CompressedData = True\n", "a.gz"), ramp);
  EXPECT_EQ(values("CompressedData = True\n", "LOCAL\n" + metaZlib(metaRamp(12))), ramp);
  const std::string size = std::to_string(metaZlib(metaRamp(12)).size());
  EXPECT_EQ(values("CompressedData = True\nCompressedDataSize = " + size + "\n",
                   "LOCAL\n" + metaZlib(metaRamp(12)) + "behind"),
            ramp);
}

TEST(MetaImageFiles, SlicesInFilesAreListedOrNumbered) {
  const TempDir folder;
  writeBytes(folder / "s008.raw", metaRamp(6));
  writeBytes(folder / "s010.raw", metaRamp(6, 6));
  writeBytes(folder / "s1.z", metaZlib(metaRamp(6)));
  writeBytes(folder / "s2.z", metaZlib(metaRamp(6, 6)));
  for (int row = 0; row < 6; ++row) writeBytes(folder / ("row" + std::to_string(row)), metaRamp(2, row * 2));
  writeBytes(folder / "all.raw", metaRamp(12));
  const auto values = [&](const std::string& dataFile, const std::string& fields = "") {
    return valuesOf(loadMeta(folder, kMeta + fields, dataFile).channels[0]);
  };
  const auto ramp = metaNumbers(0, 12);
  EXPECT_EQ(values("LIST\ns008.raw\ns010.raw\n"), ramp);
  EXPECT_EQ(values("LIST 2D\r\ns008.raw\r\ns010.raw"), ramp);
  EXPECT_EQ(values("LIST 1\nrow0\nrow1\nrow2\nrow3\nrow4\nrow5\n"), ramp);
  EXPECT_EQ(values("LIST 3\nall.raw\n"), ramp);
  EXPECT_EQ(values("s%03d.raw 8 10 2"), ramp);
  EXPECT_EQ(values("s%03d.raw 8 11 2"), ramp);
  EXPECT_EQ(values("s%d.z", "CompressedData = True\n"), ramp);
  EXPECT_EQ(values("s%d.z 1", "CompressedData = True\nCompressedDataSize = 9999\n"), ramp);
  EXPECT_THAT(metaError(folder, kMeta, "s%03d.raw 8 9 1"), HasSubstr("names \"s009.raw\", which is not in"));
  EXPECT_THAT(metaError(folder, kMeta, "s%03d.raw 8 12 2"),
              HasSubstr("ElementDataFile: expected numbers for as many files as DimSize ends with, 2"));
  EXPECT_THAT(metaError(folder, kMeta, "s%03d.raw 8 8 1"), HasSubstr("as many files"));
  EXPECT_THAT(metaError(folder, kMeta, "s%03d.raw 8 10 0"), HasSubstr("as many files"));
  EXPECT_THAT(metaError(folder, kMeta, "s%03d.raw x"), HasSubstr("whole numbers after the pattern"));
  EXPECT_THAT(metaError(folder, kMeta, "LIST\ns008.raw\n"), HasSubstr("a list of 2 files, found \"1\""));
  EXPECT_THAT(metaError(folder, kMeta, "LIST x\ns008.raw\n"), HasSubstr("LIST and the axes of each file"));
  EXPECT_THAT(
      metaError(folder, kMeta, "LIST\ns008.raw\nrow0\n"),
      HasSubstr("row0: DimSize of " + (folder / "a.mha").string() + " needs 12 bytes, the file holds 4"));
  EXPECT_THAT(metaError(folder, "NDims = 3\nDimSize = 1 1 70000\nElementType = MET_UCHAR\n", "s%d.raw"),
              HasSubstr("at most 65536 files"));
}

TEST(MetaImageFiles, ChannelsAreInterleaved) {
  const TempDir folder;
  for (const char* type : {"MET_USHORT", "MET_USHORT_ARRAY"}) {
    const LoadedFile file = loadMeta(
        folder,
        "NDims = 2\nDimSize = 2 2\nElementNumberOfChannels = 3\nElementType = " + std::string(type) + "\n");
    EXPECT_EQ(file.grid.dims, glm::ivec3(2, 2, 1));
    ASSERT_EQ(file.channels.size(), 3u);
    EXPECT_EQ(file.channels[1].name, "a 1");
    EXPECT_EQ(valuesOf(file.channels[1]), metaNumbers(1, 4, 3));
  }
}

TEST(MetaImageFiles, AFourthAxisIsTimesUnlessTheUserSaysChannels) {
  const TempDir folder;
  const std::string fields =
      "NDims = 4\nDimSize = 2 1 1 3\nElementSpacing = 1 2 3 0.5\nOffset = 0 0 0 10\n"
      "ElementType = MET_USHORT\n";
  for (const bool packed : {false, true}) {
    const std::string data = packed ? metaZlib(metaRamp(6)) : metaRamp(6);
    const std::string all = fields + (packed ? "CompressedData = True\n" : "");
    const LoadedFile last = loadMeta(folder, all, "LOCAL\n" + data, {}, 2);
    EXPECT_THAT(last.times.values, ElementsAre(10, 10.5, 11));
    ASSERT_EQ(last.channels.size(), 1u);
    EXPECT_THAT(valuesOf(last.channels[0]), ElementsAre(4, 5));
    const LoadedFile channels = loadMeta(folder, all, "LOCAL\n" + data, {}, 0, FourthAxis::channel);
    EXPECT_EQ(channels.times.count, 1u);
    ASSERT_EQ(channels.channels.size(), 3u);
    EXPECT_THAT(valuesOf(channels.channels[1]), ElementsAre(2, 3));
  }
  const LoadedFile both = loadMeta(
      folder, "NDims = 4\nDimSize = 2 1 1 3\nElementNumberOfChannels = 2\nElementType = MET_USHORT\n",
      "LOCAL\n" + metaRamp(12), {}, 1);
  EXPECT_THAT(valuesOf(both.channels[1]), ElementsAre(5, 7));
  EXPECT_THAT(errorOf([&] {
                loadMeta(folder, fields + "ElementNumberOfChannels = 2\n", "LOCAL\n" + metaRamp(12), {}, 0,
                         FourthAxis::channel);
              }),
              HasSubstr("ElementNumberOfChannels: expected 1 if the fourth axis is channels"));
}

TEST(MetaImageFiles, GridsAreBroughtFromLpsToRas) {
  const TempDir folder;
  std::vector<std::string> warnings;
  const Warn warn = [&](const std::string& line) { warnings.push_back(line); };
  for (const char* matrix : {"TransformMatrix", "Rotation", "Orientation"}) {
    for (const char* offset : {"Offset", "Position", "Origin"}) {
      const std::string fields = kMeta + matrix + " = 0 1 0 -1 0 0 0 0 1\n" + offset +
                                 " = 1 2 3\nElementSpacing = 2 3 4\nElementSize = 9 9 9\n";
      const glm::dmat4 m = loadMeta(folder, fields).grid.worldFromVoxel;
      EXPECT_EQ(glm::dvec3(m[0]), glm::dvec3(0, -2, 0)) << "row 0 of the matrix is the way of x";
      EXPECT_EQ(glm::dvec3(m[1]), glm::dvec3(3, 0, 0));
      EXPECT_EQ(glm::dvec3(m[2]), glm::dvec3(0, 0, 4));
      EXPECT_EQ(glm::dvec3(m[3]), glm::dvec3(-1, -2, 3));
    }
  }
  EXPECT_EQ(loadMeta(folder, kMeta + "ElementSize = 2 3 4\n").grid.spacing(), glm::dvec3(2, 3, 4));
  // Without a matrix the letters decide: x begins in front, y below, z at the left.
  const glm::dmat4 m = loadMeta(folder, kMeta + "AnatomicalOrientation = AIL\n").grid.worldFromVoxel;
  EXPECT_EQ(glm::dvec3(m[0]), glm::dvec3(0, -1, 0));
  EXPECT_EQ(glm::dvec3(m[1]), glm::dvec3(0, 0, 1));
  EXPECT_EQ(glm::dvec3(m[2]), glm::dvec3(1, 0, 0));
  for (const char* letters : {"???", "RRI", "RAS-", "xyz", ""})
    EXPECT_EQ(
        glm::dvec3(
            loadMeta(folder, kMeta + "AnatomicalOrientation = " + letters + "\n").grid.worldFromVoxel[1]),
        glm::dvec3(0, -1, 0))
        << letters;
  const std::string identity = kMeta + "TransformMatrix = 1 0 0 0 1 0 0 0 1\n";
  loadMeta(folder, identity + "AnatomicalOrientation = RAI\n", "LOCAL\n" + metaRamp(12), warn);
  EXPECT_TRUE(warnings.empty());
  loadMeta(folder, identity + "AnatomicalOrientation = LPI\nElementSpacing = 1 0 1\n",
           "LOCAL\n" + metaRamp(12), warn);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("AnatomicalOrientation: is not used"),
                                    HasSubstr("ElementSpacing: 0, taken as 1")));
  EXPECT_EQ(loadMeta(folder, kMeta + "DistanceUnits = um\n").worldUnit, "um");
  EXPECT_EQ(loadMeta(folder, kMeta + "DistanceUnits = ?\n").worldUnit, "mm");
}

TEST(MetaImageFiles, IntensitiesAreScaled) {
  const TempDir folder;
  const auto file = loadMeta(folder, kMeta +
                                         "ElementToIntensityFunctionSlope = 0.5\n"
                                         "ElementToIntensityFunctionOffset = -1024\n");
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(-1024.0, -1018.5));
  EXPECT_THAT(metaError(folder, kMeta + "ElementToIntensityFunctionSlope = 0\n"),
              HasSubstr("ElementToIntensityFunctionSlope: expected a number other than 0"));
}

TEST(MetaImageFiles, BadHeadersNameTheFieldThatIsWrong) {
  const TempDir folder;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string header = kMeta;
    const auto at = header.find(from);
    header.replace(at, header.find('\n', at) - at + 1, to);
    return metaError(folder, header);
  };
  EXPECT_EQ(with("ObjectType", "Comment = a\nComment = b\nMine : x\n\nName = n\n"), "");
  EXPECT_THAT(with("ObjectType", "ObjectType = Tube\n"), HasSubstr("ObjectType: expected Image, found"));
  EXPECT_THAT(with("NDims", ""), HasSubstr("NDims: is missing"));
  EXPECT_THAT(with("NDims", "NDims = 0\n"), HasSubstr("NDims: expected a whole number, at least 1"));
  EXPECT_THAT(with("NDims", "NDims = 5\n"), HasSubstr("NDims: expected 1 to 4, found \"5\""));
  EXPECT_THAT(with("NDims", "NDims = 2\n"), HasSubstr("DimSize: expected 2 numbers as NDims says"));
  EXPECT_THAT(with("NDims", "NDims = 3\nNDims = 3\n"), HasSubstr("expected every field once"));
  EXPECT_THAT(with("NDims", "NDims = 3\nno sign\n"), HasSubstr("expected lines of \"Key = value\""));
  EXPECT_THAT(with("DimSize", ""), HasSubstr("DimSize: is missing"));
  EXPECT_THAT(with("DimSize", "DimSize = 2 -3 2\n"), HasSubstr("DimSize: expected whole numbers"));
  EXPECT_THAT(with("DimSize", "DimSize = 3 3 2\n"), HasSubstr("needs 36 bytes, the file holds 24"));
  EXPECT_THAT(with("DimSize", "DimSize = 60000 60000 60000\n"), HasSubstr("the file holds"));
  EXPECT_THAT(with("DimSize", "DimSize = 99999999999 1 1\n"), HasSubstr("2^24 along an axis"));
  EXPECT_THAT(with("ElementType", ""), HasSubstr("ElementType: is missing"));
  EXPECT_THAT(with("ElementType", "ElementType = MET_STRING\n"), HasSubstr("ElementType: expected a type"));
  const auto adding = [&](const std::string& fields) { return metaError(folder, kMeta + fields); };
  EXPECT_THAT(adding("BinaryData = False\n"), HasSubstr("BinaryData: expected True"));
  EXPECT_THAT(adding("BinaryData = perhaps\n"), HasSubstr("BinaryData: expected True or False"));
  EXPECT_THAT(adding("ElementByteOrderMSB = True\nBinaryDataByteOrderMSB = False\n"),
              HasSubstr("expected the same as in BinaryDataByteOrderMSB"));
  EXPECT_THAT(adding("ElementNumberOfChannels = 0\n"), HasSubstr("ElementNumberOfChannels: expected"));
  EXPECT_THAT(adding("ElementNumberOfChannels = 5000\n"), HasSubstr("at most 4096"));
  EXPECT_THAT(adding("ElementSpacing = 1 1\n"), HasSubstr("ElementSpacing: expected 3 numbers"));
  EXPECT_THAT(adding("ElementSpacing = 1 inf 1\n"), HasSubstr("ElementSpacing: expected numbers"));
  EXPECT_THAT(adding("TransformMatrix = 1 0 0 0 1 0 0 0\n"), HasSubstr("TransformMatrix: expected 9"));
  EXPECT_THAT(adding("TransformMatrix = 1 0 0 1 0 0 0 0 1\n"), HasSubstr("singular"));
  EXPECT_THAT(adding("HeaderSize = -2\n"), HasSubstr("HeaderSize: expected a whole number, at least -1"));
  EXPECT_THAT(adding("HeaderSize = 9223372036854775807\n"), HasSubstr("the file holds"));
  EXPECT_THAT(adding("HeaderSize = -1\nCompressedData = True\n"), HasSubstr("HeaderSize: expected 0 or"));
  EXPECT_THAT(adding("CompressedData = True\nCompressedDataSize = 999\n"),
              HasSubstr("CompressedDataSize: expected at most the file's 24 bytes"));
  EXPECT_THAT(adding("CompressedData = True\n"), HasSubstr("CompressedData: the data are damaged"));
  EXPECT_THAT(metaError(folder,
                        "NDims = 4\nDimSize = 1 1 1 1\nElementType = MET_CHAR\nTransformMatrix = 1 0 "
                        "0 1 0 1 0 0 0 0 1 0 0 0 0 1\n"),
              HasSubstr("a fourth axis apart from the others"));
  EXPECT_THAT(metaError(folder, kMeta, "\n"), HasSubstr("ElementDataFile: expected LOCAL, LIST"));
  EXPECT_THAT(loadError(writeBytes(folder / "b.mhd", "")), HasSubstr("ElementDataFile: is missing"));
  EXPECT_THAT(loadError(writeBytes(folder / "c.mhd", kMeta)), HasSubstr("ElementDataFile: is missing"));
  EXPECT_THAT(loadError(writeBytes(folder / "d.mhd", kMeta + std::string(2 << 20, '\n'))),
              HasSubstr("ElementDataFile: expected within 1 MiB, found none"));
}

TEST(MetaImageFiles, HeadersNameDataOnlyInOrBelowTheirFolder) {
  const TempDir folder;
  std::filesystem::create_directory(folder / "in");
  writeBytes(folder / "secret.raw", metaRamp(12));
  for (const std::string name : {"../secret.raw", "/etc/passwd", "LIST 3\n../secret.raw", "../s%d.raw"}) {
    const auto path = writeBytes(folder / "in/a.mhd", kMeta + "ElementDataFile = " + name + "\n");
    EXPECT_THAT(loadError(path), HasSubstr("expected a file in or below the header's folder")) << name;
  }
}

TEST(MetaImageFiles, EveryTruncationIsAnErrorAndDamageIsFound) {
  const TempDir folder;
  for (const bool packed : {false, true}) {
    const std::string whole = kMeta + (packed ? "CompressedData = True\n" : "") +
                              "ElementDataFile = LOCAL\n" + (packed ? metaZlib(metaRamp(12)) : metaRamp(12));
    EXPECT_EQ(loadError(writeBytes(folder / "a.mha", whole)), "");
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(loadError(writeBytes(folder / "a.mha", whole.substr(0, length))), "") << length;
    if (!packed) continue;
    for (std::size_t i = whole.find("LOCAL\n") + 6; i < whole.size(); ++i) {
      std::string damaged = whole;
      damaged[i] = char(damaged[i] ^ 0x40);
      EXPECT_THAT(loadError(writeBytes(folder / "a.mha", damaged)), HasSubstr("CompressedData")) << i;
    }
  }
  // What unpacks to more than the voxels is not unpacked further.
  const std::string bomb = metaZlib(metaRamp(12) + std::string(64 << 20, '\0'));
  EXPECT_THAT(metaError(folder, kMeta + "CompressedData = True\n", "LOCAL\n" + bomb),
              HasSubstr("CompressedData: expected 24 unpacked bytes, found more"));
}

}  // namespace
}  // namespace scolopax::io
