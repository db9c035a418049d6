// SPDX-License-Identifier: Apache-2.0
#if SCOLOPAX_HAS_OPENVDB
#include <gmock/gmock.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <random>

#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

openvdb::GridPtrVec referenceGrids(const std::filesystem::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  return *file.getGrids();
}

std::string writeVdb(const TempDir& folder, const openvdb::GridPtrVec& grids, bool statistics = true) {
  openvdb::initialize();
  openvdb::io::File file((folder / "a.vdb").string());
  file.setGridStatsMetadataEnabled(statistics);
  file.write(grids);
  file.close();
  std::ifstream written(folder / "a.vdb", std::ios::binary);
  return {std::istreambuf_iterator<char>(written), {}};
}

/// All voxels of a box, x fastest, through OpenVDB's own accessor.
template <class Grid>
std::vector<double> referenceValues(const Grid& grid, const CoordBBox& box) {
  const auto accessor = grid.getConstAccessor();
  std::vector<double> values;
  for (int z = box.min().z(); z <= box.max().z(); ++z)
    for (int y = box.min().y(); y <= box.max().y(); ++y)
      for (int x = box.min().x(); x <= box.max().x(); ++x)
        values.push_back(double(accessor.getValue(Coord(x, y, z))));
  return values;
}

std::vector<std::string> namesOf(const VolumeInfo& volume) {
  std::vector<std::string> names;
  for (const ChannelInfo& channel : volume.channels) names.push_back(channel.name);
  return names;
}

TEST(OpenVdbFiles, AreWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("formats/vdb/smoke.vdb"));
  struct Row {
    const char *file, *grid;
    CoordBBox box;
    double spacing, low, high;
  };
  for (const Row& row :
       {Row{"smoke", "density", {{1, 2, 1}, {111, 223, 112}}, 0.476, 1e-5, 5.71},
        Row{"sphere", "ls_sphere", {Coord(-62), Coord(62)}, 0.05, -0.15, 0.15},
        Row{"torus01", "voxel_fog_density", {{-25, -4, 1}, {-4, 4, 22}}, 0.403, 0.027, 100}}) {
    SCOPED_TRACE(row.file);
    const auto path = dataFile("formats/vdb/" + std::string(row.file) + ".vdb");
    const LoadedFile file = loadFile(path, kTestLimit, {});
    const Coord size = row.box.dim();
    ASSERT_EQ(file.grid.dims, glm::ivec3(size.x(), size.y(), size.z()));
    ASSERT_EQ(file.channels.size(), 1u);
    EXPECT_EQ(file.channels[0].name, row.grid);
    EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::f32);
    const auto grid = openvdb::gridConstPtrCast<openvdb::FloatGrid>(referenceGrids(path).at(0));
    EXPECT_EQ(valuesOf(file.channels[0]), referenceValues(*grid, row.box));
    const openvdb::Vec3d first = grid->indexToWorld(row.box.min());
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(file.grid.spacing()[axis], row.spacing, 5e-4);
      EXPECT_NEAR(file.grid.worldFromVoxel[3][axis], first[axis], 1e-9);
    }
    double low = INFINITY, high = -INFINITY;  // of active voxels, as the table states
    for (auto value = grid->cbeginValueOn(); value; ++value)
      low = std::min(low, double(*value)), high = std::max(high, double(*value));
    EXPECT_NEAR(low, row.low, 1e-3);
    EXPECT_NEAR(high, row.high, 6e-3);
  }
}

TEST(OpenVdbFiles, GridsOfOneNameAreNumbered) {
  const auto path = dataFile("formats/vdb/grids.vdb");
  SKIP_WITHOUT(path);
  const auto file = openFile(path);
  const openvdb::GridPtrVec grids = referenceGrids(path);
  ASSERT_EQ(file->volumes.size(), 3u) << "each has a transform of its own";
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(file->volumes[i].path, "density[" + std::to_string(i) + "]");
    const LoadedPart part = load(*file, {.volume = i}, LoadOptions{});
    EXPECT_EQ(part.grid.dims, i == 1 ? glm::ivec3(19, 19, 22) : glm::ivec3(11));
    EXPECT_NEAR(part.grid.spacing().x, 0.1, 1e-6);
    const auto grid = openvdb::gridConstPtrCast<openvdb::FloatGrid>(grids[i]);
    EXPECT_EQ(valuesOf(part.channels.at(0)), referenceValues(*grid, grid->evalActiveVoxelBoundingBox()));
  }
}

TEST(OpenVdbFiles, GridsOfOneTransformAreChannelsOfOneBox) {
  const TempDir folder;
  const auto grid = [](const Coord& first, const Coord& last, float value) {
    const auto created = openvdb::FloatGrid::create(value / 2);
    created->setName("density");
    created->fill(CoordBBox(first, last), value);
    return created;
  };
  const auto a = grid(Coord(-20, 0, 0), Coord(-18, 1, 1), 4), b = grid(Coord(0, 5, 0), Coord(9, 7, 3), 6);
  writeVdb(folder, {a, b, b});
  const auto file = openFile(folder / "a.vdb");
  ASSERT_EQ(file->volumes.size(), 1u);
  EXPECT_THAT(namesOf(file->volumes[0]), ElementsAre("density[0]", "density[1]", "density[2]"));
  const CoordBBox box(Coord(-20, 0, 0), Coord(9, 7, 3));
  const LoadedPart part = load(*file, {}, LoadOptions{});
  EXPECT_EQ(part.grid.dims, glm::ivec3(30, 8, 4));
  EXPECT_EQ(part.grid.worldFromVoxel[3], glm::dvec4(-20, 0, 0, 1));
  EXPECT_EQ(valuesOf(part.channels[0]), referenceValues(*a, box));
  EXPECT_EQ(valuesOf(part.channels[1]), referenceValues(*b, box));
  EXPECT_EQ(valuesOf(part.channels[2]), referenceValues(*b, box)) << "shares the tree of another";
  const LoadedPart one = load(*file, {.channels = {1}}, LoadOptions{});
  ASSERT_EQ(one.channels.size(), 1u);
  EXPECT_EQ(valuesOf(one.channels[0]), valuesOf(part.channels[1]));
}

/// A grid with a background, single voxels, and a box large enough for tiles.
template <class Grid>
typename Grid::Ptr patternGrid(const char* name) {
  using Value = typename Grid::ValueType;
  const auto grid = Grid::create(Value(1));
  grid->setName(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  grid->fill(CoordBBox(Coord(-3, 5, 0), Coord(20, 30, 17)), Value(2));
  for (int i = 0; i < 20; ++i) grid->tree().setValue(Coord(i, -i, 2 * i), Value(i));
  grid->tree().setValueOff(Coord(4, 6, 8), Value(0));
  return grid;
}

const CoordBBox kPatternBox(Coord(-3, -19, 0), Coord(20, 30, 38));

TEST(OpenVdbFiles, EveryTypeOfNumbersLoads) {
  const TempDir folder;
  const auto check = [&]<class Grid>(const Grid&, ScalarType kept) {
    const auto grid = patternGrid<Grid>("values");
    for (const bool statistics : {true, false}) {
      writeVdb(folder, {grid}, statistics);
      const LoadedFile file = loadFile(folder / "a.vdb", kTestLimit, {});
      EXPECT_EQ(file.grid.dims, glm::ivec3(24, 50, 39)) << grid->type();
      EXPECT_EQ(file.grid.worldFromVoxel[3], glm::dvec4(-1.5, -9.5, 0, 1));
      ASSERT_EQ(file.channels.size(), 1u);
      EXPECT_EQ(file.channels[0].voxels.type(), kept) << grid->type();
      EXPECT_EQ(valuesOf(file.channels[0]), referenceValues(*grid, kPatternBox)) << grid->type();
    }
  };
  check(openvdb::FloatGrid(), ScalarType::f32);
  check(openvdb::DoubleGrid(), ScalarType::f32);
  check(openvdb::Int32Grid(), ScalarType::i16);
  check(openvdb::Int64Grid(), ScalarType::f32);
  check(openvdb::BoolGrid(), ScalarType::u8);
}

TEST(OpenVdbFiles, FloatsStoredAsHalvesAndVectorsLoad) {
  const TempDir folder;
  const auto half = patternGrid<openvdb::FloatGrid>("half");
  half->setSaveFloatAsHalf(true);
  const auto vectors = openvdb::Vec3SGrid::create(openvdb::Vec3f(1, 2, 3));
  vectors->setName("velocity");
  vectors->setTransform(half->transform().copy());
  vectors->fill(CoordBBox(Coord(0, 0, 0), Coord(2, 1, 0)), openvdb::Vec3f(4, 5, 6));
  vectors->tree().setValue(Coord(1, 1, 0), openvdb::Vec3f(-7, -8, -9));
  writeVdb(folder, {vectors, half});
  const auto file = openFile(folder / "a.vdb");
  ASSERT_EQ(file->volumes.size(), 1u);
  EXPECT_THAT(namesOf(file->volumes[0]), ElementsAre("half", "velocity x", "velocity y", "velocity z"));
  const LoadedPart part = load(*file, {.channels = {0, 2}}, LoadOptions{});
  EXPECT_EQ(valuesOf(part.channels[0]), referenceValues(*half, kPatternBox));
  const std::vector<double> y = valuesOf(part.channels[1]);
  const auto at = [&](int i, int j, int k) { return y[std::size_t((i + 3) + 24 * ((j + 19) + 50 * k))]; };
  EXPECT_EQ(at(0, 0, 0), 5);
  EXPECT_EQ(at(1, 1, 0), -8);
  EXPECT_EQ(at(3, 0, 0), 2) << "background";
  EXPECT_EQ(at(20, 30, 38), 2);
}

TEST(OpenVdbFiles, GridsOfOtherTransformsAreOtherVolumes) {
  const TempDir folder;
  const auto a = patternGrid<openvdb::FloatGrid>("a"), b = patternGrid<openvdb::FloatGrid>("b");
  openvdb::Mat4d matrix(0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 10, 20, 30, 1);
  b->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  writeVdb(folder, {a, b});
  const auto file = openFile(folder / "a.vdb");
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_EQ(file->volumes[0].path, "a");
  EXPECT_EQ(file->volumes[1].path, "b");
  const Grid& grid = file->volumes[1].levels[0];
  EXPECT_EQ(grid.worldFromVoxel[0], glm::dvec4(0, 2, 0, 0));
  EXPECT_EQ(grid.worldFromVoxel[1], glm::dvec4(-3, 0, 0, 0));
  const openvdb::Vec3d first = b->indexToWorld(kPatternBox.min());
  EXPECT_EQ(grid.worldFromVoxel[3], glm::dvec4(first.x(), first.y(), first.z(), 1));
  EXPECT_EQ(valuesOf(load(*file, {.volume = 1}, LoadOptions{}).channels[0]),
            referenceValues(*b, kPatternBox));
}

TEST(OpenVdbFiles, InsideALevelSetItsNegativeBackgroundCounts) {
  const TempDir folder;
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(12, openvdb::Vec3f(0), 1);
  writeVdb(folder, {sphere});
  const LoadedFile file = loadFile(folder / "a.vdb", kTestLimit, {});
  const glm::ivec3 dims = file.grid.dims;
  const auto values = valuesOf(file.channels[0]);
  EXPECT_EQ(values[std::size_t(dims.x / 2 + dims.x * (dims.y / 2 + dims.y * (dims.z / 2)))], -3);
  EXPECT_EQ(values[0], 3);
}

TEST(OpenVdbFiles, GridsThatCannotBeShownAreLeftOutOrRefused) {
  const TempDir folder;
  const auto bent = patternGrid<openvdb::FloatGrid>("bent");
  bent->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 2.0));
  writeVdb(folder, {bent});
  EXPECT_THAT(loadError(folder / "a.vdb"),
              HasSubstr("grid \"bent\": transform: expected an affine one, found \"NonlinearFrustumMap\""));
  const auto empty = openvdb::FloatGrid::create();
  empty->setName("empty");
  std::string warnings;
  writeVdb(folder, {bent, empty, patternGrid<openvdb::FloatGrid>("good")});
  const auto file = openFile(folder / "a.vdb", {.warn = [&](const std::string& line) { warnings += line; }});
  ASSERT_EQ(file->volumes.size(), 1u);
  EXPECT_THAT(namesOf(file->volumes[0]), ElementsAre("good"));
  EXPECT_THAT(warnings, AllOf(HasSubstr("transform: expected an affine one"),
                              HasSubstr("grid \"empty\": expected active voxels, found none; left out")));
  writeVdb(folder, {empty});
  EXPECT_THAT(loadError(folder / "a.vdb"), HasSubstr("expected active voxels, found none"));
  writeVdb(folder, {});
  EXPECT_THAT(loadError(folder / "a.vdb"), HasSubstr("expected a grid, found none"));
}

TEST(OpenVdbFiles, BoxesThatLieAreRefused) {
  const TempDir folder;
  const auto errorOfBox = [&](const Coord& first, const Coord& last) {
    const auto grid = patternGrid<openvdb::FloatGrid>("grid");
    grid->insertMeta("file_bbox_min", openvdb::Vec3IMetadata(first.asVec3i()));
    grid->insertMeta("file_bbox_max", openvdb::Vec3IMetadata(last.asVec3i()));
    writeVdb(folder, {grid}, false);
    return loadError(folder / "a.vdb");
  };
  EXPECT_EQ(errorOfBox(kPatternBox.min(), kPatternBox.max()), "");
  EXPECT_EQ(errorOfBox(kPatternBox.min() - Coord(2), kPatternBox.max()), "");
  EXPECT_THAT(errorOfBox(Coord(0), kPatternBox.max()),
              HasSubstr("expected active voxels in 0,0,0 to 20,30,38, found -3,-19,0 to 20,30,38"));
  EXPECT_NE(errorOfBox(Coord(-2000), Coord(2000)), "") << "more than the memory limit";
  EXPECT_NE(errorOfBox(Coord(INT32_MIN), Coord(INT32_MAX)), "");
  EXPECT_THAT(errorOfBox(Coord(5), Coord(4)), HasSubstr("expected active voxels, found none"));

  const auto tile = openvdb::FloatGrid::create();
  tile->tree().addTile(3, Coord(0), 1.0f, true);  // 4096^3 voxels in a few bytes
  writeVdb(folder, {tile});
  EXPECT_NE(loadError(folder / "a.vdb"), "");
}

TEST(OpenVdbFiles, TruncatedFilesAreRefused) {
  const TempDir folder;
  const std::string whole = writeVdb(folder, {patternGrid<openvdb::FloatGrid>("grid")});
  EXPECT_EQ(loadError(folder / "a.vdb"), "");
  for (std::size_t length = 0; length < whole.size(); length += length < 700 ? 23 : 211)
    EXPECT_NE(loadError(writeBytes(folder / "b.vdb", whole.substr(0, length))), "") << length;
  EXPECT_NE(loadError(writeBytes(folder / "b.vdb", whole.substr(0, whole.size() - 1))), "");
}

TEST(OpenVdbFiles, DamagedFilesAreRefusedOrLoad) {
  const TempDir folder;
  const std::string whole = writeVdb(folder, {patternGrid<openvdb::Int32Grid>("grid")});
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 60; ++i) {
    std::string damaged = whole;
    for (int change = 0; change < 3; ++change)
      damaged[random() % std::min<std::size_t>(damaged.size(), 1500)] = char(random());
    damaged.replace(0, 8, whole, 0, 8);  // still the format
    refused += loadError(writeBytes(folder / "b.vdb", damaged)).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 10);
}

}  // namespace
}  // namespace scolopax::io
#endif
