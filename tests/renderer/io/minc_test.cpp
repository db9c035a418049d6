// SPDX-License-Identifier: Apache-2.0
#if SCOLOPAX_HAS_HDF5
#include <gmock/gmock.h>

#include "tests/renderer/io/hdf5_test_support.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct MincFile {
  std::string order = "zspace,yspace,xspace", spacing = "regular__";
  std::vector<hsize_t> dims{2, 3, 4};
  std::vector<double> low{0}, high{23}, validRange{0, 23};
  std::vector<hsize_t> scaleDims{1};
};

/// Voxels 0, 1, ... of uint16.
void makeMinc(const fs::path& path, const MincFile& minc) {
  Hdf5Maker maker(path);
  std::size_t count = 1;
  for (const hsize_t side : minc.dims) count *= side;
  const std::string image = "/minc-2.0/image/0/image";
  maker.array(image, minc.dims, rampOf<std::uint16_t>(count));
  maker.attribute(image, "dimorder", minc.order);
  maker.attribute(image, "valid_range", minc.validRange);
  maker.array(image + "-min", minc.scaleDims, minc.low);
  maker.array(image + "-max", minc.scaleDims, minc.high);
  const std::vector<double> cosines[3] = {{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string dimension = std::string("/minc-2.0/dimensions/") + "xyz"[axis] + "space";
    maker.array(dimension, {1}, std::vector<double>{0});
    maker.attribute(dimension, "start", std::vector<double>{double(10 * (axis + 1))});
    maker.attribute(dimension, "step", std::vector<double>{axis == 1 ? -2.0 : double(axis + 1)});
    maker.attribute(dimension, "direction_cosines", cosines[axis]);
    maker.attribute(dimension, "spacing", minc.spacing);
  }
}

TEST(MincFiles, StepsStartsAndDirectionsMakeTheGrid) {
  const TempDir folder;
  makeMinc(folder / "a.mnc", {.low = {0, 0}, .high = {23, 23}, .scaleDims = {2}});
  const LoadedFile file = loadFile(folder / "a.mnc", kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(4, 3, 2));
  EXPECT_EQ(file.worldUnit, "mm");
  const glm::dmat4& m = file.grid.worldFromVoxel;
  EXPECT_NEAR(glm::distance(glm::dvec3(m[0]), glm::dvec3(0.6, 0.8, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::distance(glm::dvec3(m[1]), glm::dvec3(1.6, -1.2, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::distance(glm::dvec3(m[2]), glm::dvec3(0, 0, 3)), 0, 1e-12);
  // 10 (0.6, 0.8, 0) + 20 (-0.8, 0.6, 0) + 30 (0, 0, 1)
  EXPECT_NEAR(glm::distance(glm::dvec3(m[3]), glm::dvec3(-10, 20, 30)), 0, 1e-12);
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u16) << "one scale is a slope";
  EXPECT_EQ(valuesOf(file.channels[0]), rampOf<double>(24));
}

TEST(MincFiles, AnyOrderOfAxesLoads) {
  const TempDir folder;
  makeMinc(folder / "a.mnc",
           {.order = "xspace,zspace,yspace", .low = {0, 0}, .high = {23, 23}, .scaleDims = {2}});
  const LoadedFile file = loadFile(folder / "a.mnc", kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(2, 4, 3));
  EXPECT_EQ(valuesOf(file.channels[0])[1], 12) << "x is the slowest";
  EXPECT_EQ(valuesOf(file.channels[0])[2], 1) << "y is the fastest";
}

TEST(MincFiles, SlicesMayHaveScalesOfTheirOwn) {
  const TempDir folder;
  makeMinc(folder / "a.mnc", {.low = {0, 100}, .high = {23, 330}, .scaleDims = {2}});
  LoadedFile file = loadFile(folder / "a.mnc", kTestLimit, {});
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::f32);
  std::vector<double> values = valuesOf(file.channels[0]);
  EXPECT_EQ(values[11], 11);
  EXPECT_EQ(values[12], 100 + 12 * 10);
  EXPECT_EQ(values[23], 330);
  // By the two slowest dimensions, which here are x and z.
  std::vector<double> low, high;
  for (int row = 0; row < 6; ++row) {
    low.push_back(1000 * row);
    high.push_back(1000 * row + 23);
  }
  makeMinc(folder / "a.mnc",
           {.order = "xspace,zspace,yspace", .low = low, .high = high, .scaleDims = {2, 3}});
  file = loadFile(folder / "a.mnc", kTestLimit, {});  // dims 2, 4, 3
  values = valuesOf(file.channels[0]);
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 2; ++x)
        EXPECT_EQ(values[std::size_t((z * 4 + y) * 2 + x)], 1000 * (x * 3 + z) + (x * 3 + z) * 4 + y);
}

TEST(MincFiles, TimesAndVectorsAreTimesAndChannels) {
  const TempDir folder;
  makeMinc(folder / "a.mnc", {.order = "time,zspace,yspace,xspace,vector_dimension",
                              .dims = {2, 1, 2, 2, 3},
                              .low = {0, 0},
                              .high = {23, 23},
                              .scaleDims = {2}});
  const auto file = openFile(folder / "a.mnc");
  ASSERT_EQ(file->volumes[0].times.count, 2u);
  ASSERT_EQ(file->volumes[0].channels.size(), 3u);
  const LoadedPart part = load(*file, {.time = 1, .channels = {2}}, LoadOptions{});
  EXPECT_EQ(valuesOf(part.channels[0]), (std::vector<double>{14, 17, 20, 23}));
}

TEST(MincFiles, WhatIsNotAsTheFormatSaysIsRefused) {
  const TempDir folder;
  const auto errorFor = [&](const MincFile& minc) {
    makeMinc(folder / "a.mnc", minc);
    return loadError(folder / "a.mnc");
  };
  MincFile good{.low = {0, 0}, .high = {23, 23}, .scaleDims = {2}};
  EXPECT_EQ(errorFor(good), "");
  MincFile bad = good;
  bad.spacing = "irregular";
  EXPECT_THAT(errorFor(bad), HasSubstr("uneven grids cannot be shown"));
  bad = good;
  bad.order = "zspace,yspace";
  EXPECT_THAT(errorFor(bad), HasSubstr("dimorder: expected the names of 3 dimensions"));
  bad.order = "zspace,yspace,yspace";
  EXPECT_THAT(errorFor(bad), HasSubstr("expected each dimension once"));
  bad.order = "zspace,yspace,frequency";
  EXPECT_THAT(errorFor(bad), HasSubstr("found \"frequency\""));
  bad = good;
  bad.scaleDims = {3};
  bad.low = bad.high = {0, 1, 2};
  EXPECT_THAT(errorFor(bad), HasSubstr("image-min: expected numbers for the image's slices"));
  bad = good;
  bad.low = {0, NAN};
  EXPECT_THAT(errorFor(bad), HasSubstr("expected finite numbers"));
}

}  // namespace
}  // namespace scolopax::io
#endif
