// SPDX-License-Identifier: Apache-2.0
#if SCOLOPAX_HAS_NETCDF
#include <gmock/gmock.h>

#include <map>

#include "tests/renderer/io/io_test_support.h"
#include "tests/renderer/io/netcdf_test_support.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

/// All values of a variable of floats at one time, by the library.
std::vector<float> netcdfValues(const fs::path& path, const std::string& name, std::size_t time) {
  int file = -1, variable = -1, rank = 0;
  EXPECT_EQ(nc_open(path.c_str(), NC_NOWRITE, &file), NC_NOERR);
  EXPECT_EQ(nc_inq_varid(file, name.c_str(), &variable), NC_NOERR);
  nc_inq_varndims(file, variable, &rank);
  std::vector<int> ids(std::size_t(rank), 0);
  nc_inq_vardimid(file, variable, ids.data());
  std::vector<std::size_t> first(std::size_t(rank), 0), count(std::size_t(rank), 1);
  std::size_t all = 1;
  for (std::size_t d = 1; d < count.size(); ++d) {
    nc_inq_dimlen(file, ids[d], &count[d]);
    all *= count[d];
  }
  first[0] = time;
  std::vector<float> values(all);
  EXPECT_EQ(nc_get_vara_float(file, variable, first.data(), count.data(), values.data()), NC_NOERR);
  nc_close(file);
  return values;
}

TEST(NetcdfFiles, TheHurricaneIsWhatTheCollectionStates) {
  const fs::path path = dataFile("multichannel/wrf/wrf_ci_test_file.nc");
  SKIP_WITHOUT(path);
  std::vector<std::string> warnings;
  const auto file = openFile(path, {.warn = [&](const std::string& line) { warnings.push_back(line); }});
  std::map<std::string, const VolumeInfo*> found;
  for (const VolumeInfo& volume : file->volumes) found[volume.path] = &volume;
  ASSERT_EQ(found.size(), 11u);
  for (const char* name : {"T", "P", "PB", "QVAPOR", "QCLOUD", "QRAIN"})
    EXPECT_EQ(found.at(name)->levels[0].dims, glm::ivec3(48, 48, 14)) << name;
  EXPECT_EQ(found.at("U")->levels[0].dims, glm::ivec3(49, 48, 14));
  EXPECT_EQ(found.at("V")->levels[0].dims, glm::ivec3(48, 49, 14));
  for (const char* name : {"W", "PH", "PHB"})
    EXPECT_EQ(found.at(name)->levels[0].dims, glm::ivec3(48, 48, 15)) << name;
  for (const auto& [name, volume] : found) {
    EXPECT_EQ(volume->levels[0].spacing().x, 10000) << name;
    EXPECT_EQ(volume->levels[0].spacing().y, 10000) << name;
    EXPECT_EQ(volume->worldUnit, "m");
    EXPECT_EQ(volume->times.values, (std::vector<double>{720, 900, 1080, 1260})) << "12:00 to 21:00";
    EXPECT_EQ(volume->times.unit, "minutes");
  }
  EXPECT_EQ(found.at("U")->levels[0].worldFromVoxel[3].x, -5000) << "on the faces of the others' cells";
  EXPECT_EQ(found.at("U")->channels[0].unit, "m s-1");
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("no even coordinates along bottom_top;"),
                                    HasSubstr("no even coordinates along bottom_top_stag;")));
  const fs::path names[] = {path};
  const auto datasets = openDatasets(names);
  ASSERT_EQ(datasets.size(), 4u) << "cells, and the faces along x, y and z";
}

TEST(NetcdfFiles, TheCollectionAgreesWithTheLibrary) {
  for (const auto& [name, variables] :
       {std::pair(dataFile("multichannel/wrf/wrf_ci_test_file.nc"), std::vector<std::string>{"U", "QVAPOR"}),
        std::pair(dataFile("formats/netcdf3/vinth2p.nc"), std::vector<std::string>{"T"})}) {
    SKIP_WITHOUT(name);
    const auto file = openFile(name);
    for (std::size_t i = 0; i < file->volumes.size(); ++i) {
      const std::string& variable = file->volumes[i].path;
      if (std::ranges::find(variables, variable) == variables.end()) continue;
      const LoadedPart part = load(*file, {.volume = i, .time = 1}, LoadOptions{});
      EXPECT_TRUE(std::ranges::equal(part.channels[0].voxels.as<float>(), netcdfValues(name, variable, 1)))
          << variable;
    }
  }
}

TEST(NetcdfFiles, TheClimateModelIsWhatTheCollectionStates) {
  const fs::path path = dataFile("formats/netcdf3/vinth2p.nc");
  SKIP_WITHOUT(path);
  std::vector<std::string> warnings;
  const auto file = openFile(path, {.warn = [&](const std::string& line) { warnings.push_back(line); }});
  ASSERT_EQ(file->volumes.size(), 1u) << "PS is a plane";
  EXPECT_EQ(file->volumes[0].path, "T");
  EXPECT_EQ(file->volumes[0].levels[0].dims, glm::ivec3(128, 64, 18));
  EXPECT_EQ(file->volumes[0].times.count, 2u);
  EXPECT_EQ(file->volumes[0].levels[0].spacing().x, 360.0 / 128);
  EXPECT_EQ(file->volumes[0].worldUnit, "degrees");
  EXPECT_EQ(warnings.size(), 1u) << "latitudes and levels are uneven";
}

TEST(NetcdfFiles, EveryTypeOfBothFormatsLoads) {
  const TempDir folder;
  const nc_type classic[] = {NC_BYTE, NC_SHORT, NC_INT, NC_FLOAT, NC_DOUBLE};
  const nc_type more[] = {NC_UBYTE, NC_USHORT, NC_UINT, NC_INT64, NC_UINT64};
  const auto check = [&](nc_type type, int mode) {
    {
      NetcdfMaker maker(folder / "a.nc", mode);
      maker.variable("a", type, kZyx, netcdfRamp(24));
      maker.write();
    }
    const LoadedFile file = loadFile(folder / "a.nc", kTestLimit, {});
    EXPECT_EQ(file.grid.dims, glm::ivec3(4, 3, 2));
    EXPECT_EQ(valuesOf(file.channels[0]), netcdfRamp(24)) << type << " " << mode;
    EXPECT_EQ(file.channels[0].name, "a");
  };
  for (const nc_type type : classic)
    for (const int mode : {0, NC_64BIT_OFFSET, NC_NETCDF4}) check(type, mode);
  for (const nc_type type : more)
    for (const int mode : {NC_64BIT_DATA, NC_NETCDF4}) check(type, mode);
}

TEST(NetcdfFiles, PackedNumbersAndMissingOnesAreUnderstood) {
  const TempDir folder;
  {
    NetcdfMaker maker(folder / "a.nc", 0);
    maker.variable("packed", NC_SHORT, kZyx, netcdfRamp(24));
    maker.attribute("packed", "scale_factor", NC_DOUBLE, 0.5);
    maker.attribute("packed", "add_offset", NC_DOUBLE, 100);
    maker.attribute("packed", "units", "K");
    maker.variable("holes", NC_SHORT, kZyx, netcdfRamp(24));
    maker.attribute("holes", "_FillValue", NC_SHORT, 7);
    maker.attribute("holes", "missing_value", NC_SHORT, 9);
    maker.attribute("holes", "scale_factor", NC_DOUBLE, 2);
    maker.variable("floats", NC_FLOAT, kZyx, netcdfRamp(24));
    maker.attribute("floats", "missing_value", NC_DOUBLE, 3);
    maker.variable("bytes", NC_BYTE, kZyx, std::vector<double>(24, -1));
    maker.attribute("bytes", "_Unsigned", "true");
    maker.variable("unwritten", NC_FLOAT, kZyx, {});
    maker.write();
  }
  const auto file = openFile(folder / "a.nc");
  std::map<std::string, std::vector<double>> values;
  std::map<std::string, ScalarType> types;
  for (std::size_t i = 0; i < file->volumes.size(); ++i) {
    const LoadedPart part = load(*file, {.volume = i}, LoadOptions{});
    values[file->volumes[i].path] = valuesOf(part.channels[0]);
    types[file->volumes[i].path] = part.channels[0].voxels.type();
  }
  EXPECT_EQ(types["packed"], ScalarType::i16);
  EXPECT_EQ(values["packed"][23], 111.5);
  EXPECT_EQ(types["holes"], ScalarType::f32);
  for (int i = 0; i < 24; ++i) {
    EXPECT_EQ(std::isnan(values["holes"][std::size_t(i)]), i == 7 || i == 9);
    if (i != 7 && i != 9) {
      EXPECT_EQ(values["holes"][std::size_t(i)], 2 * i);
    }
    EXPECT_EQ(std::isnan(values["floats"][std::size_t(i)]), i == 3);
  }
  EXPECT_EQ(values["bytes"], std::vector<double>(24, 255));
  for (const double value : values["unwritten"]) EXPECT_TRUE(std::isnan(value));
}

/// A variable on axes with the coordinates given; none for those that are empty.
LoadedFile loadOnAxes(const fs::path& path, const std::vector<double>& z, const std::vector<double>& y,
                      const std::vector<double>& x, std::vector<std::string>& warnings,
                      const std::string& zUnit = "m", const std::string& zPositive = "up") {
  {
    NetcdfMaker maker(path, NC_NETCDF4);
    maker.variable("a", NC_FLOAT, kZyx, netcdfRamp(24));
    const std::vector<double>* values[] = {&z, &y, &x};
    for (std::size_t d = 0; d < 3; ++d) {
      if (values[d]->empty()) continue;
      maker.variable(kZyx[d].name, NC_DOUBLE, {kZyx[d]}, *values[d]);
      maker.attribute(kZyx[d].name, "units", d == 0 ? zUnit : "m");
    }
    if (!z.empty()) maker.attribute("z", "positive", zPositive);
    maker.write();
  }
  warnings.clear();
  return loadFile(path, kTestLimit, [&](const std::string& line) { warnings.push_back(line); });
}

TEST(NetcdfFiles, EvenCoordinatesMakeTheGrid) {
  const TempDir folder;
  std::vector<std::string> warnings;
  const auto grid = [&](auto&&... arguments) {
    const Grid loaded = loadOnAxes(folder / "a.nc", arguments...).grid;
    return std::pair(
        glm::dvec3(loaded.worldFromVoxel[0].x, loaded.worldFromVoxel[1].y, loaded.worldFromVoxel[2].z),
        glm::dvec3(loaded.worldFromVoxel[3]));
  };
  using V = std::vector<double>;
  EXPECT_EQ(grid(V{5, 15}, V{3, 1, -1}, V{0, 4, 8, 12}, warnings),
            std::pair(glm::dvec3(4, -2, 10), glm::dvec3(0, 3, 5)));
  EXPECT_THAT(warnings, ElementsAre());
  EXPECT_EQ(loadOnAxes(folder / "a.nc", {5, 15}, {3, 1, -1}, {0, 4, 8, 12}, warnings).worldUnit, "m");
  EXPECT_EQ(grid(V{5, 15}, V{0, 4, 8}, V{0, 4, 8, 12}, warnings, "m", "down"),
            std::pair(glm::dvec3(4, 4, -10), glm::dvec3(0, 0, -5)));
  EXPECT_EQ(grid(V{5, 15}, V{0, 4, 9}, V{0, 2, 4, 6}, warnings),
            std::pair(glm::dvec3(2, 6, 10), glm::dvec3(0, 0, 5)))
      << "y is uneven: the mean of 2 and 10";
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("no even coordinates along y;")));
  EXPECT_EQ(grid(V{5, 15}, V{0, 2, 4}, V{0, 2, 4, 6}, warnings, "hPa"),
            std::pair(glm::dvec3(2, 2, 2), glm::dvec3(0)))
      << "z is not a length";
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("no even coordinates along z;")));
  EXPECT_EQ(grid(V{}, V{}, V{}, warnings), std::pair(glm::dvec3(1), glm::dvec3(0)));
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("no even coordinates along x, y, z;")));
  EXPECT_EQ(grid(V{NAN, 1}, V{0, 0, 0}, V{0, 2, 4, 6}, warnings), std::pair(glm::dvec3(2), glm::dvec3(0)));
}

TEST(NetcdfFiles, TimesAndOtherDimensions) {
  const TempDir folder;
  {
    NetcdfMaker maker(folder / "a.nc", NC_NETCDF4);
    std::vector<NetcdfDim> dims = kZyx;
    dims.insert(dims.begin(), {"time", 2});
    maker.variable("a", NC_FLOAT, dims, netcdfRamp(48));
    maker.variable("time", NC_DOUBLE, {{"time", 2}}, {6, 12});
    maker.attribute("time", "units", "hours since 2000-01-01 00:00");
    dims = kZyx;
    dims.insert(dims.begin(), {{"time", 2}, {"member", 3}});
    maker.variable("members", NC_FLOAT, dims, netcdfRamp(144));
    maker.variable("plane", NC_FLOAT, {{"y", 3}, {"x", 4}}, netcdfRamp(12));
    dims = kZyx;
    dims.insert(dims.begin(), {{"member", 3}, {"more", 2}});
    maker.variable("six", NC_FLOAT, dims, netcdfRamp(144));
    maker.write();
  }
  const auto file = openFile(folder / "a.nc");
  ASSERT_EQ(file->volumes.size(), 2u) << "planes are left out, and what has too many dimensions";
  EXPECT_EQ(file->volumes[0].times.values, (std::vector<double>{6, 12}));
  EXPECT_EQ(file->volumes[0].times.unit, "hours");
  EXPECT_EQ(valuesOf(load(*file, {.time = 1}, LoadOptions{}).channels[0])[0], 24);
  ASSERT_EQ(file->volumes[1].channels.size(), 3u);
  const LoadedPart part = load(*file, {.volume = 1, .time = 1, .channels = {2}}, LoadOptions{});
  EXPECT_EQ(valuesOf(part.channels[0])[0], 72 + 48);
}

TEST(NetcdfFiles, PlanesLoadWhereThereIsNothingElse) {
  const TempDir folder;
  {
    NetcdfMaker maker(folder / "a.nc", 0);
    maker.variable("a", NC_FLOAT, {{"y", 3}, {"x", 4}}, netcdfRamp(12));
    maker.variable("x", NC_FLOAT, {{"x", 4}}, {0, 1, 2, 3});
    maker.attribute("x", "bounds", "x_bounds");
    maker.variable("x_bounds", NC_FLOAT, {{"x", 4}, {"two", 2}}, netcdfRamp(8));
    maker.write();
  }
  const auto file = openFile(folder / "a.nc");
  ASSERT_EQ(file->volumes.size(), 1u);
  EXPECT_EQ(file->volumes[0].levels[0].dims, glm::ivec3(4, 3, 1));
}

TEST(NetcdfFiles, VariablesOfGroupsHaveTheirPath) {
  const TempDir folder;
  int file = -1, group = -1, dims[3] = {}, variable = -1;
  nc_create((folder / "a.nc").c_str(), NC_NETCDF4 | NC_CLOBBER, &file);
  nc_def_dim(file, "z", 2, &dims[0]);
  nc_def_dim(file, "y", 3, &dims[1]);
  nc_def_dim(file, "x", 4, &dims[2]);
  nc_def_grp(file, "g", &group);
  nc_def_var(group, "a", NC_FLOAT, 3, dims, &variable);
  nc_put_var_double(group, variable, netcdfRamp(24).data());
  nc_close(file);
  const auto opened = openFile(folder / "a.nc");
  EXPECT_EQ(opened->volumes.at(0).path, "g/a");
  EXPECT_EQ(valuesOf(load(*opened, {}, LoadOptions{}).channels[0]), netcdfRamp(24));
}

}  // namespace
}  // namespace scolopax::io
#endif
