// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/vtk_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string vtkJsArrayText(const std::string& ref, const std::string& type = "Int16Array") {
  return R"({"data": {"name": "a", "numberOfComponents": 2, "dataType": ")" + type +
         R"(", "ref": {"encode": "BigEndian", "basepath": "data", "id": ")" + ref + R"("}}})";
}

/// The index of an image of 2x3x1 points.
std::string vtkJsText(const std::string& points, const std::string& cells = "",
                      const std::string& more = "") {
  return R"({"vtkClass": "vtkImageData", "extent": [1, 2, 0, 2, 5, 5], "origin": [1, 2, 3],)" + more +
         R"("spacing": [2, 3, 4], "pointData": {"arrays": [)" + points + R"(]}, "cellData": {"arrays": [)" +
         cells + "]}}";
}

TEST(VtkJsFolders, AreWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("formats/vtkjs_http"));
  const LoadedFile chest = loadVtk(dataFile("formats/vtkjs_http/LIDC2.vti"));
  EXPECT_EQ(chest.grid.dims, glm::ivec3(256, 256, 133));
  EXPECT_EQ(chest.grid.spacing(), glm::dvec3(1.40625, 1.40625, 2.5));
  EXPECT_THAT(vtkNames(chest), ElementsAre("ImageScalars"));
  EXPECT_EQ(chest.channels[0].voxels.type(), ScalarType::u8);
  EXPECT_EQ(rangeOf(chest.channels[0]), std::pair(0.0, 255.0));
  EXPECT_EQ(vtkSum(chest.channels[0]), 61489178) << "by Python's gzip module";

  const LoadedFile head = loadVtk(dataFile("formats/vtkjs_http/headsq.vti"));
  EXPECT_EQ(head.grid.dims, glm::ivec3(64, 64, 93));
  EXPECT_EQ(head.channels[0].voxels.type(), ScalarType::i16);
  EXPECT_EQ(rangeOf(head.channels[0]), std::pair(0.0, 3926.0));
  EXPECT_EQ(vtkSum(head.channels[0]), 193392317);
  const glm::dmat4& m = head.grid.worldFromVoxel;
  EXPECT_EQ(glm::dvec3(m[0]), 3.2 * glm::dvec3(0.866, 0.5, 0)) << "the first three numbers are the x axis";
  EXPECT_EQ(glm::dvec3(m[1]), 3.2 * glm::dvec3(-0.5, 0.866, 0));
  EXPECT_EQ(glm::dvec3(m[2]), glm::dvec3(0, 0, 1.5));
}

TEST(VtkJsFolders, PackedAndPlainArraysLoad) {
  const TempDir folder;
  std::filesystem::create_directory(folder / "data");
  writeBytes(folder / "data/plain", vtkShorts(12, 5, true));
  writeBytes(folder / "data/packed.gz", gzipped(vtkShorts(4, 7, true)));
  writeBytes(folder / "index.json", vtkJsText(vtkJsArrayText("plain"), vtkJsArrayText("packed")));
  const auto file = openFile(folder.path());
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_THAT(file->dataFiles, ElementsAre(folder / "data/plain", folder / "data/packed.gz"));
  const LoadedPart points = load(*file, {}, LoadOptions{}), cells = load(*file, {.volume = 1}, LoadOptions{});
  EXPECT_EQ(valuesOf(points.channels.at(1)), vtkRamp(6, 6, 2));
  EXPECT_EQ(points.channels[1].name, "a Y");
  EXPECT_EQ(glm::dvec3(points.grid.worldFromVoxel[3]), glm::dvec3(1 + 2, 2, 3 + 20));
  EXPECT_EQ(valuesOf(cells.channels.at(0)), vtkRamp(7, 2, 2));
  EXPECT_EQ(cells.grid.dims, glm::ivec3(1, 2, 1));
}

TEST(VtkJsFolders, LiesAreToldWithTheField) {
  const TempDir folder;
  std::filesystem::create_directory(folder / "data");
  writeBytes(folder / "data/a", vtkShorts(12, 0, true));
  writeBytes(folder / "data/short.gz", gzipped(vtkShorts(11, 0, true)));
  writeBytes(folder / "secret", vtkShorts(12));
  const auto error = [&](const std::string& text) {
    writeBytes(folder / "index.json", text);
    return loadError(folder.path());
  };
  ASSERT_EQ(error(vtkJsText(vtkJsArrayText("a"))), "");
  EXPECT_THAT(error("{\"vtkClass\""), HasSubstr("index.json: expected JSON"));
  EXPECT_THAT(error(R"({"vtkClass": "vtkPolyData"})"),
              HasSubstr("expected vtkImageData, found \"vtkPolyData\""));
  EXPECT_THAT(error(R"({"vtkClass": "vtkImageData"})"), HasSubstr("extent: is missing"));
  EXPECT_THAT(error(R"({"vtkClass": "vtkImageData", "extent": [0, 1, 0, 1, 0]})"),
              HasSubstr("extent: expected 6 numbers"));
  EXPECT_THAT(error(R"({"vtkClass": "vtkImageData", "extent": [0, 1, 0, 1, 0, 1.5]})"),
              HasSubstr("extent: expected whole numbers"));
  EXPECT_THAT(error(vtkJsText("", "", R"("direction": [1, 0, "x"],)")), HasSubstr("direction: expected 9"));
  EXPECT_THAT(error(vtkJsText("")), HasSubstr("expected arrays of numbers on points or cells"));
  EXPECT_THAT(error(vtkJsText("7, []")), HasSubstr("expected a dataType such as Int16Array"));
  EXPECT_THAT(error(vtkJsText(vtkJsArrayText("a", "BigUint64Array"))), HasSubstr("found \"BigUint64Array\""));
  EXPECT_THAT(error(vtkJsText(vtkJsArrayText("a", "Float32Array"))), HasSubstr("the file holds at most 24"));
  EXPECT_THAT(error(vtkJsText(vtkJsArrayText("gone"))), HasSubstr("names \"data/gone\", which is not in"));
  EXPECT_THAT(error(vtkJsText(vtkJsArrayText("../secret"))), HasSubstr("in or below the header's folder"));
  EXPECT_THAT(error(vtkJsText(vtkJsArrayText("short"))), HasSubstr("bytes more, found"));
  EXPECT_THAT(error("{\"vtkClass\"" + std::string(2 << 20, ' ')), HasSubstr("at most 1 MiB"));
}

}  // namespace
}  // namespace scolopax::io
