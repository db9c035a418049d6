// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <teem/nrrd.h>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kRamp = bytesOf(std::vector<std::uint16_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
const std::string kMinimal =
    "NRRD0004\ntype: ushort\ndimension: 3\nsizes: 2 3 2\nendian: little\nencoding: raw\n";

LoadedFile loadText(const TempDir& folder, const std::string& header, const std::string& data = kRamp) {
  return loadFile(writeBytes(folder / "a.nrrd", header + "\n" + data), kTestLimit, {});
}
std::vector<double> rampTo(int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(i);
  return values;
}

TEST(NrrdFiles, TheToothIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("scalar/tooth.nhdr"));
  const LoadedFile file = loadFile(dataFile("scalar/tooth.nhdr"), kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(103, 94, 161));
  EXPECT_EQ(file.grid.worldFromVoxel, glm::dmat4(1.0));
  ASSERT_EQ(file.channels.size(), 1u);
  EXPECT_EQ(file.channels[0].name, "tooth");
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u16);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 1300.0));
}

TEST(NrrdFiles, BreastMriIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("labels/breast_mri"));
  const LoadedFile image = loadFile(dataFile("labels/breast_mri/breast1_image.nrrd"), kTestLimit, {});
  EXPECT_EQ(image.grid.dims, glm::ivec3(45, 120, 21));
  EXPECT_EQ(image.channels[0].voxels.type(), ScalarType::i16);
  EXPECT_EQ(rangeOf(image.channels[0]), std::pair(6.0, 248.0));
  EXPECT_EQ(image.grid.spacing(), glm::dvec3(0.66406200000000004, 0.66406200000000004, 2.1));
  EXPECT_EQ(glm::dvec3(image.grid.worldFromVoxel[3]),
            glm::dvec3(116.54304, 48.14465400000001, 9.4500000000000295));
  const LoadedFile label = loadFile(dataFile("labels/breast_mri/breast1_label.nrrd"), kTestLimit, {});
  EXPECT_EQ(rangeOf(label.channels[0]), std::pair(0.0, 1.0));
  EXPECT_TRUE(sameGrid(image.grid, label.grid));
}

TEST(NrrdFiles, TheSameBrainAsNiftiHasTheSameVoxelsAndGrid) {
  SKIP_WITHOUT(dataFile("multichannel/stroke_mri/FLAIR.nrrd"));
  const LoadedFile nrrd = loadFile(dataFile("multichannel/stroke_mri/FLAIR.nrrd"), kTestLimit, {});
  const LoadedFile nifti = loadFile(dataFile("multichannel/stroke_mri/FLAIR.nii.gz"), kTestLimit, {});
  EXPECT_TRUE(std::ranges::equal(nrrd.channels[0].voxels.as<std::uint8_t>(),
                                 nifti.channels[0].voxels.as<std::uint8_t>()));
  EXPECT_TRUE(sameGrid(nrrd.grid, nifti.grid)) << "sameGrid's tolerance is 1e-4 voxel";
}

TEST(NrrdFiles, AgreeWithTheReferenceReader) {
  SKIP_WITHOUT(dataFile("multichannel/stroke_mri/FLAIR.nrrd"));
  for (const char* name :
       {"multichannel/stroke_mri/FLAIR.nrrd", "labels/breast_mri/breast1_image.nrrd", "scalar/tooth.nhdr"}) {
    SCOPED_TRACE(name);
    const LoadedFile file = loadFile(dataFile(name), kTestLimit, {});
    Nrrd* image = nrrdNew();
    ASSERT_EQ(nrrdLoad(image, dataFile(name).c_str(), nullptr), 0);
    const VoxelBuffer& voxels = file.channels[0].voxels;
    ASSERT_EQ(voxels.sizeBytes(), nrrdElementNumber(image) * nrrdElementSize(image));
    EXPECT_EQ(std::memcmp(voxels.data(), image->data, voxels.sizeBytes()), 0);
    nrrdNuke(image);
  }
}

TEST(NrrdFiles, WhatIsWrittenComesBackExactly) {
  const TempDir folder;
  Grid grid{{5, 4, 3}, glm::dmat4(1.0)};
  grid.worldFromVoxel = {{0.1, 0.2, -0.3, 0}, {0, 1.0 / 3, 1e-7, 0}, {5, 0, 1e9, 0}, {-0.0, 1e6 + 0.1, 7, 1}};
  const auto roundTrip = [&]<class T>(T step) {
    std::vector<ChannelSource> channels(3);
    for (std::size_t c = 0; c < 3; ++c) {
      channels[c].voxels = VoxelBuffer(scalarTypeOf<T>, grid.voxelCount());
      for (std::size_t i = 0; i < 60; ++i) channels[c].voxels.as<T>()[i] = T(T(i + 60 * c) * step);
    }
    channels[0].name = "density of \xCF\x88";
    channels[1].name = "back\\slash: =#";
    channels[2].name = "last";
    channels[1].unit = "1/mm";
    channels[1].slope = 1.0 / 3;
    channels[2].intercept = -1e-300;
    writeNrrd(folder / "a.nrrd", grid, channels);
    const LoadedFile file = loadFile(folder / "a.nrrd", kTestLimit, {});
    EXPECT_EQ(file.grid.dims, grid.dims);
    EXPECT_EQ(file.grid.worldFromVoxel, grid.worldFromVoxel);
    ASSERT_EQ(file.channels.size(), 3u);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(file.channels[c].name, channels[c].name);
      EXPECT_EQ(file.channels[c].unit, channels[c].unit);
      EXPECT_EQ(file.channels[c].slope, channels[c].slope);
      EXPECT_EQ(file.channels[c].intercept, channels[c].intercept);
      ASSERT_EQ(file.channels[c].voxels.type(), scalarTypeOf<T>);
      EXPECT_TRUE(std::ranges::equal(file.channels[c].voxels.as<T>(), channels[c].voxels.as<T>()));
    }
    Nrrd* image = nrrdNew();  // and the reference reader accepts it as NRRD
    EXPECT_EQ(nrrdLoad(image, (folder / "a.nrrd").c_str(), nullptr), 0);
    EXPECT_EQ(image->dim, 4u);
    EXPECT_EQ(image->axis[3].size, 3u);
    EXPECT_EQ(std::memcmp(static_cast<std::byte*>(image->data) + 60 * sizeof(T), channels[1].voxels.data(),
                          60 * sizeof(T)),
              0);
    nrrdNuke(image);
  };
  roundTrip(std::uint8_t(1));
  roundTrip(std::uint16_t(300));
  roundTrip(std::int16_t(-150));
  roundTrip(0.1f);
}

TEST(NrrdFiles, OneTypeForAllChannelsIsDemandedOnWriting) {
  const TempDir folder;
  std::vector<ChannelSource> channels(2);
  channels[0].voxels = VoxelBuffer(ScalarType::u8, 1);
  channels[1].voxels = VoxelBuffer(ScalarType::f32, 1);
  EXPECT_THAT(errorOf([&] { writeNrrd(folder / "a.nrrd", {}, channels); }),
              HasSubstr("the first channel's type"));
  EXPECT_THAT(errorOf([&] { writeNrrd(folder / "a.nrrd", {}, {}); }), HasSubstr("found none"));
  channels.pop_back();
  channels[0].voxels.as<std::uint8_t>()[0] = 1;
  EXPECT_THAT(errorOf([&] { writeNrrd(folder / "no/a.nrrd", {}, channels); }),
              HasSubstr("cannot be written"));
}

TEST(NrrdFiles, ByteOrdersEncodingsAndLineEndsOfTheHeaderLoad) {
  const TempDir folder;
  EXPECT_EQ(valuesOf(loadText(folder, kMinimal).channels[0]), rampTo(12));
  std::string big = kMinimal;
  big.replace(big.find("little"), 6, "BIG");
  std::vector<std::uint16_t> ramp(12);
  for (std::size_t i = 0; i < 12; ++i) ramp[i] = std::uint16_t(i);
  EXPECT_EQ(valuesOf(loadText(folder, big, bytesOf(ramp, true)).channels[0]), rampTo(12));
  std::string packed = kMinimal;
  packed.replace(packed.find("raw"), 3, "gzip");
  EXPECT_EQ(valuesOf(loadText(folder, packed, gzipped(kRamp)).channels[0]), rampTo(12));
  std::string windows;
  for (const char c : kMinimal) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const auto path = writeBytes(folder / "w.nrrd", windows + "\r\n" + kRamp);
  EXPECT_EQ(valuesOf(loadFile(path, kTestLimit, {}).channels[0]), rampTo(12));
}

TEST(NrrdFiles, DetachedDataAreSkippedAsTheHeaderSays) {
  const TempDir folder;
  const auto load = [&](const std::string& fields, const std::string& data) {
    writeBytes(folder / "d.bin", data);
    const auto path = writeBytes(folder / "a.nhdr", kMinimal + "data file: d.bin\n" + fields);
    return valuesOf(loadFile(path, kTestLimit, {}).channels[0]);
  };
  EXPECT_EQ(load("", kRamp), rampTo(12));
  EXPECT_EQ(load("byte skip: 3\n", "abc" + kRamp), rampTo(12));
  EXPECT_EQ(load("byteskip: -1", "any length" + kRamp), rampTo(12));
  EXPECT_EQ(load("line skip: 2\nbyte skip: 1\n", "one\ntwo\n!" + kRamp), rampTo(12));
}

TEST(NrrdFiles, AnAxisThatIsNotSpatialBecomesChannels) {
  const TempDir folder;
  const std::string common = "NRRD0005\ntype: uint16\nendian: little\nencoding: raw\ndimension: 4\n";
  const LoadedFile vectors =
      loadText(folder, common + "sizes: 2 3 2 1\nkinds: vector domain domain domain\nspacings: nan 1 2 3\n");
  EXPECT_EQ(vectors.grid.dims, glm::ivec3(3, 2, 1));
  EXPECT_EQ(vectors.grid.spacing(), glm::dvec3(1, 2, 3));
  ASSERT_EQ(vectors.channels.size(), 2u);
  EXPECT_EQ(valuesOf(vectors.channels[1]), (std::vector<double>{1, 3, 5, 7, 9, 11}));
  EXPECT_EQ(vectors.channels[1].name, "a 1");

  const LoadedFile list =
      loadText(folder, common +
                           "sizes: 3 1 2 2\nspace: RAS\nspace directions: (1, 0, 0) (0,1,0) (0,0,1) none\n"
                           "kinds: domain domain domain list\n");
  ASSERT_EQ(list.channels.size(), 2u);
  EXPECT_EQ(valuesOf(list.channels[1]), (std::vector<double>{6, 7, 8, 9, 10, 11}));

  const LoadedFile colors = loadText(folder, common + "sizes: 3 2 2 1\nkinds: RGB-color space space space\n");
  ASSERT_EQ(colors.channels.size(), 3u);
  EXPECT_EQ(colors.channels[2].name, "a blue");

  const auto errorFor = [&](const std::string& fields) {
    return errorOf([&] { loadText(folder, common + fields, std::string(10000, 'x')); });
  };
  EXPECT_THAT(errorFor("sizes: 2 3 2 1\nkinds: domain vector domain domain\n"), HasSubstr("first or last"));
  EXPECT_THAT(errorFor("sizes: 4097 1 1 1\nkinds: vector domain domain domain\n"),
              HasSubstr("at most 4096 along an axis that is not spatial, found \"4097\""));
  EXPECT_THAT(errorFor("sizes: 2 3 2 1\nkinds: complex domain domain domain\n"),
              HasSubstr("kinds: expected real voxels"));
}

TEST(NrrdFiles, AFourthAxisIsTimesOrChannels) {
  const TempDir folder;
  const auto kindOf = [&](const std::string& fields, FourthAxis fourthAxis = FourthAxis::automatic) {
    const auto path = writeBytes(folder / "a.nrrd",
                                 "NRRD0005\ntype: uint16\nendian: little\nencoding: raw\ndimension: "
                                 "4\n" +
                                     fields + "\n" + kRamp);
    const VolumeInfo volume = openFile(path, {.fourthAxis = fourthAxis})->volumes[0];
    return std::to_string(volume.times.count) + " times, " + std::to_string(volume.channels.size()) +
           " channels";
  };
  EXPECT_EQ(kindOf("sizes: 3 2 1 2\nkinds: domain domain domain time\n"), "2 times, 1 channels");
  EXPECT_EQ(kindOf("sizes: 2 2 1 3\nkinds: domain domain domain time\n"), "3 times, 1 channels");
  EXPECT_EQ(kindOf("sizes: 3 2 1 2\nkinds: domain domain domain list\n"), "1 times, 2 channels");
  EXPECT_EQ(kindOf("sizes: 3 2 1 2\nkinds: domain domain domain list\n", FourthAxis::time),
            "2 times, 1 channels");
  EXPECT_EQ(kindOf("sizes: 3 2 1 2\nkinds: domain domain domain time\n", FourthAxis::channel),
            "1 times, 2 channels");
  EXPECT_EQ(kindOf("sizes: 2 3 1 2\n"), "2 times, 1 channels") << "unmarked";
  EXPECT_EQ(kindOf("sizes: 2 2 1 3\n"), "1 times, 3 channels") << "unmarked, of 3";
  EXPECT_EQ(kindOf("sizes: 3 2 2 1\n"), "1 times, 3 channels") << "unmarked, the first of 3";
  EXPECT_EQ(kindOf("sizes: 2 2 1 3\nunits: \"mm\" \"mm\" \"mm\" \"s\"\n"), "3 times, 1 channels");
  EXPECT_EQ(kindOf("sizes: 3 2 1 2\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n"),
            "2 times, 1 channels");
  EXPECT_EQ(kindOf("sizes: 2 2 1 3\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n"),
            "1 times, 3 channels");

  const auto last = [&](const char* fields) {
    kindOf(fields);
    return valuesOf(loadFile(folder / "a.nrrd", kTestLimit, {}, 1).channels[0]);
  };
  EXPECT_EQ(last("sizes: 3 2 1 2\nkinds: domain domain domain time\n"),
            (std::vector<double>{6, 7, 8, 9, 10, 11}));
  EXPECT_EQ(last("sizes: 2 3 2 1\nkinds: time domain domain domain\n"),
            (std::vector<double>{1, 3, 5, 7, 9, 11}));
}

TEST(NrrdFiles, EverySpaceIsBroughtToRas) {
  const TempDir folder;
  const std::string directions = "space directions: (1,2,3) (-4,5,6) (7,8,-9)\nspace origin: (10,20,30)\n";
  struct Row {
    const char* space;
    glm::dvec3 signs;
  };
  for (const Row& row :
       {Row{"right-anterior-superior", {1, 1, 1}}, Row{"RAS", {1, 1, 1}}, Row{"LAS", {-1, 1, 1}},
        Row{"left-anterior-superior", {-1, 1, 1}}, Row{"LPS", {-1, -1, 1}},
        Row{"left-posterior-superior", {-1, -1, 1}}, Row{"scanner-xyz", {1, 1, 1}}}) {
    const auto m = loadText(folder, kMinimal + "space: " + row.space + "\n" + directions).grid.worldFromVoxel;
    EXPECT_EQ(glm::dvec3(m[0]), row.signs * glm::dvec3(1, 2, 3)) << row.space;
    EXPECT_EQ(glm::dvec3(m[2]), row.signs * glm::dvec3(7, 8, -9)) << row.space;
    EXPECT_EQ(glm::dvec3(m[3]), row.signs * glm::dvec3(10, 20, 30)) << row.space;
  }
  EXPECT_THAT(errorOf([&] { loadText(folder, kMinimal + "space: right-anterior-superior-time\n"); }),
              HasSubstr("space: expected"));
}

TEST(NrrdFiles, BadHeadersNameTheFieldThatIsWrong) {
  const TempDir folder;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string header = kMinimal;
    const auto at = header.find(from);
    header.replace(at, header.find('\n', at) - at + 1, to);
    return errorOf([&] { loadText(folder, header); });
  };
  EXPECT_THAT(with("NRRD", "NRRD0006\n"), HasSubstr("magic: expected NRRD0001 to NRRD0005"));
  EXPECT_THAT(with("NRRD", "PNG\n"), HasSubstr("magic"));
  EXPECT_THAT(with("type", ""), HasSubstr("type: is missing"));
  EXPECT_THAT(with("type", "type: block\n"), HasSubstr("type: expected a scalar type, found \"block\""));
  EXPECT_THAT(with("dimension", "dimension: 0\n"), HasSubstr("dimension: expected 1 to 16"));
  EXPECT_THAT(with("dimension", "dimension: 99999999999\n"), HasSubstr("dimension"));
  EXPECT_THAT(with("dimension", "dimension: 4\n"), HasSubstr("sizes: expected 4 entries"));
  EXPECT_THAT(with("sizes", "sizes: 2 -3 2\n"), HasSubstr("sizes: expected whole numbers"));
  EXPECT_THAT(with("sizes", "sizes: 2 3.5 2\n"), HasSubstr("sizes"));
  EXPECT_THAT(with("sizes", "sizes: 2147483648 1 1\n"), HasSubstr("sizes: expected at most"));
  EXPECT_THAT(
      with("sizes", "sizes: 1 1 16777217\n"),
      HasSubstr("sizes: expected at most 2^48 voxels and 2^24 along an axis, found 1 x 1 x 16777217"));
  EXPECT_THAT(with("sizes", "sizes: 1 1 16777216\n"), HasSubstr("the file holds"));
  EXPECT_THAT(with("sizes", "sizes: 2000000000 2000000000 2000000000\n"),
              HasSubstr("sizes: expected at most"));
  EXPECT_THAT(with("sizes", "sizes: 60000 60000 60000\n"), HasSubstr("the file holds"));
  EXPECT_THAT(with("sizes", "sizes: 300 300 300\n"), HasSubstr("the file holds"));
  EXPECT_THAT(with("sizes", "sizes: 3 3 3\n"), HasSubstr("the file holds"));
  EXPECT_THAT(with("endian", ""), HasSubstr("endian: is missing"));
  EXPECT_THAT(with("endian", "endian: middle\n"), HasSubstr("endian: expected little or big"));
  for (const char* encoding : {"ascii", "hex", "bzip2", "what"}) {
    EXPECT_THAT(with("encoding", std::string("encoding: ") + encoding + "\n"),
                HasSubstr("encoding: expected raw or gzip"));
  }
  EXPECT_THAT(with("encoding", "encoding: gzip\n"), HasSubstr("expected gzip data"));
  EXPECT_THAT(with("endian", "endian: little\nendian: big\n"), HasSubstr("expected every field once"));
  EXPECT_THAT(with("endian", "endian: little\nno colon\n"), HasSubstr("expected lines of"));
  EXPECT_THAT(with("endian", "endian: little\nspacings: 1 x 1\n"), HasSubstr("spacings: expected numbers"));
  EXPECT_THAT(with("endian", "endian: little\nspacings: 1 1\n"), HasSubstr("spacings: expected 3 entries"));
  for (const char* vectors : {"(1,0) (0,1) (1,1)", "(1,0,nan) (0,1,0) (0,0,1)", "(1,0,0,0) (0,1,0) (0,0,1)",
                              "1 0 0", "(1,0,0", "((1,0,0)"}) {
    EXPECT_THAT(with("endian", std::string("endian: little\nspace directions: ") + vectors + "\n"),
                HasSubstr("space directions: expected"))
        << vectors;
  }
  EXPECT_THAT(with("endian", "endian: little\nspace origin: 1 2 3\n"),
              HasSubstr("space origin: expected vectors"));
  EXPECT_THAT(with("endian", "endian: little\nbyte skip: -2\n"), HasSubstr("byte skip: expected"));
  EXPECT_THAT(with("endian", "endian: little\nbyte skip: 9223372036854775807\n"),
              HasSubstr("the file holds"));
  EXPECT_THAT(with("endian", "endian: little\nline skip: 1000\n"), HasSubstr("line skip: expected"));
  EXPECT_THAT(with("endian", "endian: little\nchannel 0 slope:=0\n"), HasSubstr("channel 0 slope: expected"));
  EXPECT_THAT(loadError(writeBytes(folder / "b.nrrd", kMinimal)), HasSubstr("expected an empty line"));
  EXPECT_THAT(loadError(writeBytes(folder / "c.nrrd", "")), HasSubstr("magic"));
  EXPECT_THAT(loadError(writeBytes(folder / "d.nrrd", kMinimal + std::string(3 << 20, '#'))),
              HasSubstr("within 1 MiB"));
}

TEST(NrrdFiles, ASingularGridIsRefusedWithTheFile) {
  const TempDir folder;
  const std::vector<std::filesystem::path> paths{writeBytes(
      folder / "flat.nrrd", kMinimal + "space: RAS\nspace directions: (1,0,0) (2,0,0) (0,0,1)\n\n" + kRamp)};
  EXPECT_THAT(errorOf([&] { loadDatasets(paths, kTestLimit, {}); }),
              AllOf(HasSubstr("flat.nrrd"), HasSubstr("singular")));
}

TEST(NrrdFiles, HeadersNameDataOnlyInOrBelowTheirFolder) {
  const TempDir folder;
  std::filesystem::create_directory(folder / "in");
  writeBytes(folder / "secret.raw", kRamp);
  writeBytes(folder / "in/d.raw", kRamp);
  std::filesystem::create_symlink("../secret.raw", folder / "in/link.raw");
  const auto errorFor = [&](const std::string& name) {
    return loadError(writeBytes(folder / "in/a.nhdr", kMinimal + "data file: " + name + "\n"));
  };
  EXPECT_EQ(errorFor("./d.raw"), "");
  for (const std::string& name : {std::string("../secret.raw"), (folder / "secret.raw").string(),
                                  std::string("link.raw"), std::string("/dev/zero")}) {
    EXPECT_THAT(errorFor(name), HasSubstr("data file: expected a file in or below the header's folder"))
        << name;
  }
  EXPECT_THAT(errorFor("gone.raw"), HasSubstr("data file: names \"gone.raw\", which is not in"));
  EXPECT_THAT(errorFor("LIST\nd.raw"), HasSubstr("data file: expected one file"));
  EXPECT_THAT(errorFor("d%03d.raw 1 10 1"), HasSubstr("data file: expected one file"));
}

TEST(NrrdFiles, EveryTruncationAndABombAreHarmless) {
  const TempDir folder;
  std::string header = kMinimal;
  header.replace(header.find("raw"), 3, "gzip");
  const std::string whole = header + "\n" + gzipped(kRamp);
  for (std::size_t length = 0; length + 9 < whole.size(); ++length) {
    EXPECT_NE(loadError(writeBytes(folder / "a.nrrd", whole.substr(0, length))), "") << length;
  }
  const std::string bomb = header + "\n" + gzipped(kRamp + std::string(64 << 20, '\0'));
  EXPECT_EQ(loadError(writeBytes(folder / "a.nrrd", bomb), kRamp.size()), "");
  std::string damaged = header + "\n" + gzipped(std::string(kRamp.size(), 'x'));
  damaged[header.size() + 13] = char(damaged[header.size() + 13] ^ 0x55);
  EXPECT_NE(loadError(writeBytes(folder / "a.nrrd", damaged)), "");
}

}  // namespace
}  // namespace scolopax::io
