// SPDX-License-Identifier: Apache-2.0
#if SCOLOPAX_HAS_HDF5
#include <gmock/gmock.h>

#include <map>

#include "tests/renderer/io/hdf5_test_support.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Hdf5Files, TheOvuleIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("formats/hdf5/sample_ovule.h5"));
  const fs::path names[] = {dataFile("formats/hdf5/sample_ovule.h5")};
  const auto datasets = openDatasets(names);
  ASSERT_EQ(datasets.size(), 1u) << "the image and its labels lie on one grid";
  EXPECT_EQ(datasets[0].worldUnit, "um");
  const auto volume = loadVolume(datasets[0], 0, 0, {});
  EXPECT_EQ(volume->grid().dims, glm::ivec3(128, 128, 32));
  EXPECT_NEAR(volume->grid().spacing().x, 0.15, 1e-6);
  EXPECT_NEAR(volume->grid().spacing().y, 0.15, 1e-6);
  EXPECT_NEAR(volume->grid().spacing().z, 0.235, 1e-6);
  ASSERT_EQ(volume->channels().size(), 2u);
  const auto channel = [&](const std::string& name) -> const Channel& {
    return *std::ranges::find(volume->channels(), name, &Channel::name);
  };
  EXPECT_EQ(channel("raw").voxels.type(), ScalarType::u8);
  EXPECT_EQ(channel("raw").histogram.minimum, 13);
  EXPECT_EQ(channel("raw").histogram.maximum, 254);
  EXPECT_FALSE(channel("raw").look.labels);
  EXPECT_EQ(channel("label").voxels.type(), ScalarType::u16);
  EXPECT_EQ(channel("label").histogram.minimum, 0);
  EXPECT_EQ(channel("label").histogram.maximum, 918);
  EXPECT_TRUE(channel("label").look.labels);
}

TEST(Hdf5Files, TheOvuleAgreesWithTheLibrary) {
  const fs::path path = dataFile("formats/hdf5/sample_ovule.h5");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  for (std::size_t i = 0; i < file->volumes.size(); ++i) {
    const LoadedPart part = load(*file, {.volume = i}, LoadOptions{});
    std::vector<double> expected(128 * 128 * 32);
    const hid_t opened = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    const hid_t set = H5Dopen2(opened, file->volumes[i].path.c_str(), H5P_DEFAULT);
    ASSERT_GE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, expected.data()), 0);
    H5Dclose(set);
    H5Fclose(opened);
    EXPECT_EQ(valuesOf(part.channels[0]), expected) << file->volumes[i].path;
  }
}

TEST(Hdf5Files, EveryTypeAndByteOrderLoads) {
  const TempDir folder;
  const hid_t types[] = {H5T_STD_I8LE,   H5T_STD_I8BE,   H5T_STD_U8LE,      H5T_STD_I16LE,  H5T_STD_I16BE,
                         H5T_STD_U16LE,  H5T_STD_U16BE,  H5T_STD_I32LE,     H5T_STD_I32BE,  H5T_STD_U32BE,
                         H5T_STD_I64LE,  H5T_STD_I64BE,  H5T_STD_U64LE,     H5T_IEEE_F32LE, H5T_IEEE_F32BE,
                         H5T_IEEE_F64LE, H5T_IEEE_F64BE, H5T_NATIVE_LDOUBLE};
  for (const hid_t type : types) {
    Hdf5Maker(folder / "a.h5").array("/a", {2, 3, 4}, rampOf<double>(24), {.type = type});
    const LoadedFile file = loadFile(folder / "a.h5", kTestLimit, {});
    EXPECT_EQ(file.grid.dims, glm::ivec3(4, 3, 2));
    EXPECT_EQ(valuesOf(file.channels[0]), rampOf<double>(24));
  }
}

TEST(Hdf5Files, NegativeAndLargeValuesKeepTheirTypes) {
  const TempDir folder;
  Hdf5Maker(folder / "i8.h5").array<std::int8_t>("/a", {1, 1, 2}, {-128, 127});
  EXPECT_EQ(valuesOf(loadFile(folder / "i8.h5", kTestLimit, {}).channels[0]),
            (std::vector<double>{-128, 127}));
  Hdf5Maker(folder / "u16.h5").array<std::uint16_t>("/a", {1, 1, 2}, {0, 65535}, {.type = H5T_STD_U16BE});
  const LoadedFile u16 = loadFile(folder / "u16.h5", kTestLimit, {});
  EXPECT_EQ(u16.channels[0].voxels.type(), ScalarType::u16);
  EXPECT_EQ(valuesOf(u16.channels[0]), (std::vector<double>{0, 65535}));
}

TEST(Hdf5Files, HalfFloatsAndBoolsOfOtherProgramsLoad) {
  const TempDir folder;
  const hid_t half = H5Tcopy(H5T_IEEE_F32LE);
  H5Tset_fields(half, 15, 10, 5, 0, 10);
  H5Tset_size(half, 2);
  H5Tset_ebias(half, 15);
  Hdf5Maker(folder / "a.h5").array<float>("/a", {1, 2, 2}, {0, 0.5f, -2, 2048}, {.type = half});
  H5Tclose(half);
  EXPECT_EQ(valuesOf(loadFile(folder / "a.h5", kTestLimit, {}).channels[0]),
            (std::vector<double>{0, 0.5, -2, 2048}));
  const hid_t boolean = H5Tenum_create(H5T_NATIVE_INT8);
  const std::int8_t no = 0, yes = 1;
  H5Tenum_insert(boolean, "FALSE", &no);
  H5Tenum_insert(boolean, "TRUE", &yes);
  {
    Hdf5Maker maker(folder / "b.h5");
    maker.array<std::int8_t>("/a", {1, 2, 2}, {}, {.type = boolean});
    const hid_t set = H5Dopen2(maker.file(), "/a", H5P_DEFAULT);
    const std::int8_t values[] = {1, 0, 0, 1};
    ASSERT_GE(H5Dwrite(set, boolean, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), 0);
    H5Dclose(set);
  }
  H5Tclose(boolean);
  EXPECT_EQ(valuesOf(loadFile(folder / "b.h5", kTestLimit, {}).channels[0]),
            (std::vector<double>{1, 0, 0, 1}));
}

TEST(Hdf5Files, ChunksOfEveryShapeAndPackingLoad) {
  const TempDir folder;
  const std::vector<hsize_t> dims{7, 11, 13};
  for (const std::vector<hsize_t>& chunk :
       {std::vector<hsize_t>{1, 1, 1}, {7, 11, 13}, {2, 3, 5}, {1, 11, 13}, {7, 1, 1}, {7, 11, 1}}) {
    for (const bool packed : {false, true}) {
      Hdf5Maker(folder / "a.h5")
          .array("/a", dims, rampOf<std::uint16_t>(1001),
                 {.chunk = chunk, .deflate = packed ? 6 : -1, .shuffle = packed});
      EXPECT_EQ(valuesOf(loadFile(folder / "a.h5", kTestLimit, {}).channels[0]), rampOf<double>(1001));
    }
  }
}

TEST(Hdf5Files, ArraysLargerThanAPieceLoad) {
  // 40 MB: pieces end within a plane of chunks, and one chunk is larger than a piece.
  const TempDir folder;
  const std::vector<hsize_t> dims{20, 1000, 1000};
  const auto values = [] {
    std::vector<std::uint16_t> some(20'000'000);
    for (std::size_t i = 0; i < some.size(); ++i) some[i] = std::uint16_t(i * 40503u >> 7);
    return some;
  }();
  for (const std::vector<hsize_t>& chunk : {std::vector<hsize_t>{}, {3, 300, 700}, {20, 1000, 1000}}) {
    Hdf5Maker(folder / "a.h5").array("/a", dims, values, {.chunk = chunk});
    const LoadedFile file = loadFile(folder / "a.h5", kTestLimit, {});
    EXPECT_TRUE(std::ranges::equal(file.channels[0].voxels.as<std::uint16_t>(), values));
  }
}

TEST(Hdf5Files, EveryArrayOfNumbersIsAVolumeWithItsPath) {
  const TempDir folder;
  {
    Hdf5Maker maker(folder / "a.h5");
    maker.array("/plane", {3, 4}, rampOf<float>(12));
    maker.array("/deep/er/volume", {2, 3, 4}, rampOf<float>(24));
    maker.array("/line", {4}, rampOf<float>(4));
    maker.array("/empty", {0, 3, 4}, std::vector<float>());
    maker.array("/six", {1, 1, 1, 1, 1, 1}, rampOf<float>(1));
  }
  EXPECT_THAT(hdf5Paths(folder / "a.h5"), ElementsAre("deep/er/volume", "plane"));
  const fs::path names[] = {(folder / "a.h5").string() + ":/deep/er/volume"};
  EXPECT_EQ(openDatasets(names).at(0).channels.at(0).name, "deep/er/volume");
  const fs::path none[] = {(folder / "a.h5").string() + ":/line"};
  EXPECT_THAT(errorOf([&] { openDatasets(none); }), HasSubstr("expected one of deep/er/volume, plane"));
  const auto file = openFile(folder / "a.h5");
  EXPECT_EQ(file->volumes[1].levels[0].dims, glm::ivec3(4, 3, 1));
}

TEST(Hdf5Files, AFourthAxisFollowsTheRulesOrTheLabels) {
  const TempDir folder;
  const auto check = [&](const std::vector<hsize_t>& dims, FourthAxis axis, std::size_t times,
                         std::size_t channels, const std::vector<std::string>& labels = {}) {
    std::size_t count = 1;
    for (const hsize_t side : dims) count *= side;
    {
      Hdf5Maker maker(folder / "a.h5");
      maker.array("/a", dims, rampOf<float>(count));
      if (!labels.empty()) maker.attribute("/a", "DIMENSION_LABELS", labels);
    }
    const auto file = openFile(folder / "a.h5", {.fourthAxis = axis});
    EXPECT_EQ(file->volumes[0].times.count, times);
    EXPECT_EQ(file->volumes[0].channels.size(), channels);
    return file;
  };
  check({2, 4, 5, 6}, FourthAxis::automatic, 2, 1);
  check({2, 4, 5, 6}, FourthAxis::channel, 1, 2);
  check({3, 4, 5, 6}, FourthAxis::automatic, 1, 3);
  check({3, 4, 5, 6}, FourthAxis::time, 3, 1);
  auto file = check({2, 4, 5, 3}, FourthAxis::automatic, 1, 3);
  EXPECT_EQ(file->volumes[0].levels[0].dims, glm::ivec3(5, 4, 2));
  LoadedPart part = load(*file, {.channels = {2}}, LoadOptions{});
  EXPECT_EQ(valuesOf(part.channels[0])[0], 2) << "the fastest axis is channels";
  EXPECT_EQ(valuesOf(part.channels[0])[1], 5);
  file = check({2, 2, 4, 5, 6}, FourthAxis::automatic, 2, 2, {"time", "channel", "z", "y", "x"});
  part = load(*file, {.time = 1, .channels = {0, 1}}, LoadOptions{});
  EXPECT_EQ(valuesOf(part.channels[1])[0], 3 * 120);
  file = check({4, 5, 6}, FourthAxis::automatic, 1, 1, {"x", "y", "z"});
  EXPECT_EQ(file->volumes[0].levels[0].dims, glm::ivec3(4, 5, 6));
  EXPECT_EQ(valuesOf(load(*file, {}, LoadOptions{}).channels[0])[1], 30) << "x is the slowest";
  check({2, 4, 5, 6}, FourthAxis::automatic, 2, 1, {"x", "x", "y", "z"});  // labels that cannot be
  check({2, 4, 5, 6}, FourthAxis::automatic, 2, 1, {"x", "y", "z"});
}

TEST(Hdf5Files, TheAxesOfIlastikAreKnown) {
  const TempDir folder;
  const auto dimsWith = [&](const std::string& tags) {
    {
      Hdf5Maker maker(folder / "a.h5");
      maker.array("/a", {4, 5, 6, 2}, rampOf<float>(240));
      maker.attribute("/a", "axistags", tags);
    }
    const auto file = openFile(folder / "a.h5");
    return std::pair(file->volumes[0].levels[0].dims, file->volumes[0].channels.size());
  };
  EXPECT_EQ(dimsWith(R"({"axes": [{"key": "z", "typeFlags": 2, "resolution": 0}, {"key": "y"}, {"key": "x"},
                                  {"key": "c", "typeFlags": 1}]})"),
            std::pair(glm::ivec3(6, 5, 4), std::size_t(2)));
  for (const char* bad :
       {"", "{", "[]", R"({"axes": 3})", R"({"axes": [1, 2, 3, 4]})", R"({"axes": [{"key": 1}]})"})
    EXPECT_EQ(dimsWith(bad), std::pair(glm::ivec3(2, 6, 5), std::size_t(1))) << bad;
}

TEST(Hdf5Files, VoxelSizesComeFromTheArrayItsSiblingOrItsGroup) {
  const TempDir folder;
  {
    Hdf5Maker maker(folder / "a.h5");
    maker.array("/raw", {2, 3, 4}, rampOf<float>(24));
    maker.array("/label", {2, 3, 4}, rampOf<std::uint16_t>(24));
    maker.array("/other", {2, 2, 2}, rampOf<float>(8));
    maker.array("/g/in", {2, 2, 2}, rampOf<float>(8));
    maker.array("/h/bad", {2, 2, 2}, rampOf<float>(8));
    maker.attribute("/raw", "element_size_um", std::vector<double>{3, 2, 1});
    maker.attribute("/g", "resolution", std::vector<double>{6, 5, 4});
    maker.attribute("/h/bad", "element_size_um", std::vector<double>{0, -1, 1});
  }
  std::map<std::string, std::pair<glm::dvec3, std::string>> found;
  const auto file = openFile(folder / "a.h5");
  for (const VolumeInfo& volume : file->volumes)
    found[volume.path] = {volume.levels[0].spacing(), volume.worldUnit};
  EXPECT_EQ(found["raw"], std::pair(glm::dvec3(1, 2, 3), std::string("um")));
  EXPECT_EQ(found["label"], std::pair(glm::dvec3(1, 2, 3), std::string("um")));
  EXPECT_EQ(found["other"], std::pair(glm::dvec3(1), std::string()));
  EXPECT_EQ(found["g/in"], std::pair(glm::dvec3(4, 5, 6), std::string()));
  EXPECT_EQ(found["h/bad"], std::pair(glm::dvec3(1), std::string()));
}

TEST(Hdf5Files, AnotherProgramsBlockMayComeFirst) {
  const TempDir folder;
  Hdf5Maker(folder / "a.mat", 512).array("/a", {1, 2, 2}, rampOf<float>(4));
  EXPECT_EQ(valuesOf(loadFile(folder / "a.mat", kTestLimit, {}).channels[0]), rampOf<double>(4));
}

}  // namespace
}  // namespace scolopax::io
#endif
