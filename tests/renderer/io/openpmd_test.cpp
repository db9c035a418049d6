// SPDX-License-Identifier: Apache-2.0
#if SCOLOPAX_HAS_HDF5
#include <gmock/gmock.h>

#include "tests/renderer/io/hdf5_test_support.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> pmdPaths(const VolumeFile& file) {
  std::vector<std::string> paths;
  for (const VolumeInfo& volume : file.volumes) paths.push_back(volume.path);
  return paths;
}

TEST(OpenPmdFiles, TheMagneticFieldIsWhatTheCollectionStates) {
  const fs::path path = dataFile("multichannel/femm/example-femm-3d.h5");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  EXPECT_THAT(pmdPaths(*file), ElementsAre("data/1/meshes/B/x", "data/1/meshes/B/y", "data/1/meshes/B/z",
                                           "data/1/meshes/E/x", "data/1/meshes/E/y", "data/1/meshes/E/z"));
  // Read whole by the library; its first dimension is x.
  constexpr std::size_t kSide = 47;
  for (std::size_t i = 0; i < 3; ++i) {
    std::vector<double> stored(kSide * kSide * kSide);
    const hid_t opened = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    const hid_t set = H5Dopen2(opened, file->volumes[i].path.c_str(), H5P_DEFAULT);
    ASSERT_GE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, stored.data()), 0);
    H5Dclose(set);
    H5Fclose(opened);
    const LoadedPart part = load(*file, {.volume = i}, LoadOptions{});
    ASSERT_EQ(part.grid.dims, glm::ivec3(47));
    EXPECT_NEAR(glm::distance(part.grid.spacing(), glm::dvec3(0.05, 0.05, 0.125)), 0, 1e-9);
    EXPECT_NEAR(glm::distance(glm::dvec3(part.grid.worldFromVoxel[3]), glm::dvec3(-1.15, -1.15, -0.375)), 0,
                1e-9);
    const auto values = part.channels[0].voxels.as<float>();
    std::size_t wrong = 0;
    for (std::size_t z = 0; z < kSide; ++z)
      for (std::size_t y = 0; y < kSide; ++y)
        for (std::size_t x = 0; x < kSide; ++x)
          wrong += values[(z * kSide + y) * kSide + x] != float(stored[(x * kSide + y) * kSide + z]);
    EXPECT_EQ(wrong, 0u);
  }
  EXPECT_EQ(file->volumes[0].channels[0].unit, "kg s^-2 A^-1") << "tesla";
  EXPECT_EQ(rangeOf(load(*file, {.volume = 3}, LoadOptions{}).channels[0]), std::pair(0.0, 0.0))
      << "the electric field is constant";
  const fs::path chosen[] = {path.string() + ":/data/1/meshes/B"};
  EXPECT_EQ(openDatasets(chosen).at(0).channels.size(), 3u);
}

/// A record of which component x is 2x3x4, with attributes as given.
struct PmdRecord {
  std::string order = "C";
  std::vector<std::string> labels{"z", "y", "x"};
  std::vector<double> spacing{3, 2, 1}, offset{30, 20, 10}, position{0, 0, 0};
  double gridUnit = 1, unit = 1;
  std::string geometry = "cartesian";
};

void makePmd(const fs::path& path, const PmdRecord& record, const std::vector<int>& iterations = {0}) {
  Hdf5Maker maker(path);
  maker.attribute("/", "openPMD", std::string("1.1.0"));
  maker.attribute("/", "basePath", std::string("/data/%T/"));
  maker.attribute("/", "meshesPath", std::string("fields/"));
  for (const int iteration : iterations) {
    const std::string group = "/data/" + std::to_string(iteration), mesh = group + "/fields/E";
    std::vector<float> values = rampOf<float>(24);
    for (float& value : values) value += float(100 * iteration);
    maker.array(mesh + "/x", {2, 3, 4}, values);
    maker.attribute(group, "time", std::vector<double>{double(iteration)});
    maker.attribute(group, "timeUnitSI", std::vector<double>{0.5});
    maker.attribute(mesh, "dataOrder", record.order);
    maker.attribute(mesh, "axisLabels", record.labels);
    maker.attribute(mesh, "geometry", record.geometry);
    maker.attribute(mesh, "gridSpacing", record.spacing);
    maker.attribute(mesh, "gridGlobalOffset", record.offset);
    maker.attribute(mesh, "gridUnitSI", std::vector<double>{record.gridUnit});
    maker.attribute(mesh, "unitDimension", std::vector<double>{1, 0, -1, 0, 0, 0.5, 0});
    maker.attribute(mesh + "/x", "position", record.position);
    maker.attribute(mesh + "/x", "unitSI", std::vector<double>{record.unit});
    maker.array(group + "/particles/e/position/x", {5, 5}, rampOf<float>(25));
  }
}

TEST(OpenPmdFiles, TheRecordsAttributesMakeTheGrid) {
  const TempDir folder;
  makePmd(folder / "a.h5", {.position = {0.5, 0, 0.25}, .gridUnit = 10, .unit = 3});
  LoadedFile file = loadFile(folder / "a.h5", kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(4, 3, 2));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(10, 20, 30));
  EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(102.5, 200, 315));
  EXPECT_EQ(file.worldUnit, "m");
  EXPECT_EQ(valuesOf(file.channels[0])[2], 6) << "unitSI is the slope";
  EXPECT_EQ(file.channels[0].unit, "m s^-1 mol^0.5");
  EXPECT_EQ(file.channels[0].name, "E/x");
}

TEST(OpenPmdFiles, LabelsAndOrderSayWhichAxisIsWhich) {
  const TempDir folder;
  makePmd(folder / "a.h5", {.labels = {"x", "y", "z"}});
  LoadedFile file = loadFile(folder / "a.h5", kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(2, 3, 4));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(3, 2, 1));
  EXPECT_EQ(valuesOf(file.channels[0])[1], 12) << "x is the slowest";
  makePmd(folder / "a.h5", {.order = "F", .labels = {"x", "y", "z"}});
  file = loadFile(folder / "a.h5", kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(4, 3, 2)) << "attributes begin with the fastest axis";
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(3, 2, 1));
  EXPECT_EQ(valuesOf(file.channels[0])[1], 1);
  makePmd(folder / "a.h5", {.labels = {"a", "b", "c"}});
  EXPECT_EQ(loadFile(folder / "a.h5", kTestLimit, {}).grid.dims, glm::ivec3(4, 3, 2));
}

TEST(OpenPmdFiles, IterationsAreTimesInTheirOrder) {
  const TempDir folder;
  makePmd(folder / "a.h5", {}, {0, 20, 100});  // by name, 100 is before 20
  const auto file = openFile(folder / "a.h5");
  ASSERT_EQ(file->volumes.size(), 1u);
  EXPECT_EQ(file->volumes[0].path, "E/x");
  EXPECT_EQ(file->volumes[0].times.values, (std::vector<double>{0, 10, 50}));
  EXPECT_EQ(file->volumes[0].times.unit, "s");
  EXPECT_EQ(valuesOf(load(*file, {.time = 1}, LoadOptions{}).channels[0])[0], 2000);
  EXPECT_EQ(valuesOf(load(*file, {.time = 2}, LoadOptions{}).channels[0])[0], 10000);
}

TEST(OpenPmdFiles, WhatCannotBeShownIsRefused) {
  const TempDir folder;
  makePmd(folder / "a.h5", {.geometry = "thetaMode"});
  EXPECT_THAT(loadError(folder / "a.h5"), HasSubstr("geometry: expected cartesian, found \"thetamode\""));
  makePmd(folder / "a.h5", {.spacing = {1, 1}});
  EXPECT_THAT(loadError(folder / "a.h5"), HasSubstr("gridSpacing: expected 3 numbers, found 2"));
  makePmd(folder / "a.h5", {.spacing = {1, 0, 1}});
  EXPECT_THAT(loadError(folder / "a.h5"), HasSubstr("expected numbers above 0"));
  {
    Hdf5Maker maker(folder / "b.h5");
    maker.attribute("/", "openPMD", std::string("1.1.0"));
    maker.attribute("/", "meshesPath", std::string("fields/"));
    maker.array("/data/0/particles/e/x", {5, 5}, rampOf<float>(25));
  }
  EXPECT_THAT(loadError(folder / "b.h5"), HasSubstr("expected openPMD meshes, found none"));
}

TEST(OpenPmdFiles, ConstantsHaveTheirValueEverywhereAndOddShapesAreRefused) {
  const TempDir folder;
  const auto make = [&](const std::vector<double>& shape) {
    Hdf5Maker maker(folder / "a.h5");
    maker.attribute("/", "openPMD", std::string("1.1.0"));
    maker.attribute("/", "meshesPath", std::string("fields/"));
    maker.group("/data/0/fields/rho");
    maker.attribute("/data/0/fields/rho", "value", std::vector<double>{2.5});
    maker.attribute("/data/0/fields/rho", "shape", shape);
  };
  make({2, 3, 4});
  const LoadedFile file = loadFile(folder / "a.h5", kTestLimit, {});
  EXPECT_EQ(file.grid.dims, glm::ivec3(4, 3, 2));
  EXPECT_EQ(valuesOf(file.channels[0]), std::vector<double>(24, 2.5));
  for (const std::vector<double>& odd :
       {std::vector<double>{0, 3, 4}, {-1, 3, 4}, {1e300, 3, 4}, {NAN, 3, 4}, {1e14, 3, 4}, {5, 5, 5, 5}}) {
    make(odd);
    EXPECT_THAT(loadError(folder / "a.h5"), HasSubstr("a.h5:/data/0/fields/rho"));
  }
  make({1e6, 1e4, 1e4});
  EXPECT_THAT(loadError(folder / "a.h5"), HasSubstr("of memory, the limit is"));
}

}  // namespace
}  // namespace scolopax::io
#endif
