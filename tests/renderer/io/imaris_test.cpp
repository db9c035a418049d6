// SPDX-License-Identifier: Apache-2.0
#if SCOLOPAX_HAS_HDF5
#include <gmock/gmock.h>

#include "tests/renderer/io/hdf5_test_support.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(ImarisFiles, TheMinimalFileIsWhatTheCollectionStates) {
  const fs::path path = dataFile("formats/imaris/Minimal_IMS_File.ims");
  SKIP_WITHOUT(path);
  const auto opened = openFile(path);
  ASSERT_EQ(opened->volumes.size(), 1u);
  EXPECT_EQ(opened->volumes[0].levels.size(), 1u);
  EXPECT_EQ(opened->volumes[0].times.count, 1u);
  const LoadedFile file = loadFile(path, kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(128, 128, 1));
  EXPECT_EQ(file.worldUnit, "um");
  // From 3 to 10, 3 to 10 and 0 to 0.1.
  const glm::dvec3 first(file.grid.worldFromVoxel * glm::dvec4(-0.5, -0.5, -0.5, 1));
  const glm::dvec3 last(file.grid.worldFromVoxel * glm::dvec4(127.5, 127.5, 0.5, 1));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(first[axis], axis < 2 ? 3 : 0, 1e-12);
    EXPECT_NEAR(last[axis], axis < 2 ? 10 : 0.1, 1e-12);
  }
  ASSERT_EQ(file.channels.size(), 1u);
  EXPECT_EQ(file.channels[0].name, "Minimal_IMS_File");
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u16);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(43.0, 141.0));
  EXPECT_FALSE(file.channels[0].look.color || file.channels[0].look.window) << "the file has none";
}

/// The name of an array of the file.
std::string imarisPath(int level, int time, int channel) {
  return "/DataSet/ResolutionLevel " + std::to_string(level) + "/TimePoint " + std::to_string(time) +
         "/Channel " + std::to_string(channel);
}

/// Two levels (6x4x2 and 3x2x1 in padded arrays), two times, two channels. A
/// voxel is 1000 level + 100 time + 10 channel + x, padding is 9999.
void makeImaris(const fs::path& path, const std::string& sizeX = "6") {
  Hdf5Maker maker(path);
  for (int level = 0; level < 2; ++level) {
    const int width = level == 0 ? 6 : 3, height = level == 0 ? 4 : 2, depth = level == 0 ? 2 : 1;
    for (int time = 0; time < 2; ++time) {
      for (int channel = 0; channel < 2; ++channel) {
        const hsize_t side = 8;
        std::vector<std::uint16_t> values(side * side * side, 9999);
        for (int z = 0; z < depth; ++z)
          for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
              values[std::size_t((z * 8 + y) * 8 + x)] =
                  std::uint16_t(1000 * level + 100 * time + 10 * channel + x);
        const std::string group = imarisPath(level, time, channel);
        maker.array(group + "/Data", {side, side, side}, values, {.chunk = {4, 4, 4}, .deflate = 2});
        maker.letters(group, "ImageSizeX", level == 0 ? sizeX : "3");
        maker.letters(group, "ImageSizeY", std::to_string(height));
        maker.letters(group, "ImageSizeZ", std::to_string(depth));
      }
    }
  }
  for (const char* group : {"Image", "Channel 0", "Channel 1", "TimeInfo"})
    maker.group(std::string("/DataSetInfo/") + group);
  maker.letters("/DataSetInfo/Image", "Unit", "nm");
  const char* const extents[3][2] = {{"-3.0", "9.0"}, {"0", "4"}, {"10.0", "20.0"}};
  for (int axis = 0; axis < 3; ++axis) {
    maker.letters("/DataSetInfo/Image", "ExtMin" + std::to_string(axis), extents[axis][0]);
    maker.letters("/DataSetInfo/Image", "ExtMax" + std::to_string(axis), extents[axis][1]);
  }
  maker.letters("/DataSetInfo/Channel 0", "Name", "DAPI");
  maker.letters("/DataSetInfo/Channel 0", "Color", "0.000 0.500 1.000");
  maker.letters("/DataSetInfo/Channel 0", "ColorRange", "5.000 250.000");
  maker.letters("/DataSetInfo/Channel 1", "Name", "(name not specified)");
  maker.letters("/DataSetInfo/Channel 1", "ColorMode", "TableColor");
  maker.letters("/DataSetInfo/Channel 1", "Color", "1 0 0");
  maker.letters("/DataSetInfo/TimeInfo", "TimePoint1", "2009-12-31 23:59:58.500");
  maker.letters("/DataSetInfo/TimeInfo", "TimePoint2", "2010-01-01 00:00:01.000");
}

TEST(ImarisFiles, LevelsTimesAndChannelsLoadWithoutTheirPadding) {
  const TempDir folder;
  makeImaris(folder / "a.ims");
  const auto file = openFile(folder / "a.ims");
  ASSERT_EQ(file->volumes.size(), 1u);
  const VolumeInfo& volume = file->volumes[0];
  ASSERT_EQ(volume.levels.size(), 2u);
  ASSERT_EQ(volume.times.count, 2u);
  ASSERT_EQ(volume.channels.size(), 2u);
  for (std::size_t level = 0; level < 2; ++level)
    for (std::size_t time = 0; time < 2; ++time) {
      const LoadedPart part = load(*file, {.level = level, .time = time}, LoadOptions{});
      const int width = level == 0 ? 6 : 3;
      ASSERT_EQ(part.grid.dims, level == 0 ? glm::ivec3(6, 4, 2) : glm::ivec3(3, 2, 1));
      for (std::size_t channel = 0; channel < 2; ++channel) {
        std::vector<double> expected;
        for (std::size_t i = 0; i < part.grid.voxelCount(); ++i)
          expected.push_back(double(1000 * level + 100 * time + 10 * channel + i % std::size_t(width)));
        EXPECT_EQ(valuesOf(part.channels[channel]), expected) << level << " " << time << " " << channel;
      }
    }
}

TEST(ImarisFiles, WhatTheFileSaysOfItsChannelsGridAndTimesIsKept) {
  const TempDir folder;
  makeImaris(folder / "a.ims");
  const auto file = openFile(folder / "a.ims");
  const VolumeInfo& volume = file->volumes.at(0);
  EXPECT_EQ(volume.worldUnit, "nm");
  EXPECT_EQ(volume.channels[0].name, "DAPI");
  const std::array<std::uint8_t, 3> color{0, 128, 255};
  EXPECT_EQ(volume.channels[0].look.color, color);
  ASSERT_TRUE(volume.channels[0].look.window);
  EXPECT_EQ(volume.channels[0].look.window->lo, 5);
  EXPECT_EQ(volume.channels[0].look.window->hi, 250);
  EXPECT_EQ(volume.channels[1].name, "a 1");
  EXPECT_FALSE(volume.channels[1].look.color) << "its colours are a table";
  EXPECT_EQ(volume.times.values, (std::vector<double>{0, 2.5}));
  EXPECT_EQ(volume.times.unit, "s");
  EXPECT_EQ(volume.levels[0].spacing(), glm::dvec3(2, 1, 5));
  EXPECT_EQ(glm::dvec3(volume.levels[0].worldFromVoxel[3]), glm::dvec3(-2, 0.5, 12.5));
  EXPECT_EQ(volume.levels[1].spacing(), glm::dvec3(4, 2, 10));
  EXPECT_EQ(glm::dvec3(volume.levels[1].worldFromVoxel[3]), glm::dvec3(-1, 1, 15));
}

TEST(ImarisFiles, TheLayoutIsKnownUnderAnyName) {
  const TempDir folder;
  makeImaris(folder / "a.h5");
  EXPECT_EQ(openFile(folder / "a.h5")->volumes.at(0).levels.size(), 2u);
}

TEST(ImarisFiles, SizesBeyondTheArrayAreRefused) {
  const TempDir folder;
  for (const char* size : {"9", "0", "-1", "x", "99999999999999999999"}) {
    makeImaris(folder / "a.ims", size);
    EXPECT_THAT(loadError(folder / "a.ims"), HasSubstr("ImageSizeX: expected 1 to 8, found \"")) << size;
  }
}

TEST(ImarisFiles, ArraysThatAreMissingOrDifferAreNamed) {
  const TempDir folder;
  makeImaris(folder / "a.ims");
  const auto change = [&](auto&& call) {
    const hid_t opened = H5Fopen((folder / "a.ims").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    call(opened);
    H5Fclose(opened);
  };
  change([](hid_t opened) { H5Ldelete(opened, (imarisPath(1, 1, 1) + "/Data").c_str(), H5P_DEFAULT); });
  const auto reopened = openFile(folder / "a.ims");
  EXPECT_EQ(errorOf([&] { load(*reopened, {.level = 0, .time = 1}, LoadOptions{}); }), "");
  EXPECT_THAT(errorOf([&] { load(*reopened, {.level = 1, .time = 1}, LoadOptions{}); }),
              HasSubstr("ResolutionLevel 1/TimePoint 1/Channel 1/Data: expected an "
                        "array, found none"));
  change([](hid_t opened) {
    const hsize_t dims[] = {8, 8, 8};
    const hid_t space = H5Screate_simple(3, dims, nullptr);
    H5Dclose(H5Dcreate2(opened, (imarisPath(1, 1, 1) + "/Data").c_str(), H5T_NATIVE_FLOAT, space, H5P_DEFAULT,
                        H5P_DEFAULT, H5P_DEFAULT));
    H5Sclose(space);
  });
  EXPECT_THAT(errorOf([&] { load(*openFile(folder / "a.ims"), {.level = 1, .time = 1}, LoadOptions{}); }),
              HasSubstr("expected uint16 of 3 dimensions"));
}

TEST(ImarisFiles, WithoutTheLayoutEveryArrayIsAVolume) {
  const TempDir folder;
  Hdf5Maker(folder / "a.ims").array("/b", {2, 2, 2}, rampOf<float>(8));
  EXPECT_EQ(openFile(folder / "a.ims")->volumes.at(0).path, "b");
}

}  // namespace
}  // namespace scolopax::io
#endif
