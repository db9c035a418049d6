// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/vtk_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

/// An image of 2x3x2 points and its data.
std::string vtkLegacyText(
    const std::string& data, const std::string& coding = "ASCII",
    const std::string& grid = "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 2\nSPACING 1 2 3\nORIGIN 4 5 6\n") {
  return "# vtk DataFile Version 3.0\nA title with DATASET in it\n" + coding + "\n" + grid + data;
}

const std::string kVtkTwelve = "1 2 3 4 5 6\n7 8 9\n10 11 12\n";

TEST(VtkLegacyFiles, TheCarotidIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("formats/vtk_legacy/carotid.vtk"));
  const LoadedFile file = loadVtk(dataFile("formats/vtk_legacy/carotid.vtk"));
  EXPECT_EQ(file.grid.dims, glm::ivec3(76, 49, 45));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(1));
  EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(100, 80, 1));
  ASSERT_THAT(vtkNames(file), ElementsAre("scalars", "vectors X", "vectors Y", "vectors Z"));
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 580.0));
  // The sums come from Python's struct module.
  EXPECT_EQ(vtkSum(file.channels[0]), 16598647);
  EXPECT_NEAR(vtkSum(file.channels[1]), -1112.633641921065, 1e-7);
  EXPECT_NEAR(vtkSum(file.channels[2]), -4521.9875918708703, 1e-7);
  EXPECT_NEAR(vtkSum(file.channels[3]), 9407.8908085533785, 1e-7);
  double fastest = 0;
  const auto x = valuesOf(file.channels[1]), y = valuesOf(file.channels[2]), z = valuesOf(file.channels[3]);
  for (std::size_t i = 0; i < x.size(); ++i)
    fastest = std::max(fastest, std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]));
  EXPECT_NEAR(fastest, 22.7, 0.05) << "as the table states";
}

TEST(VtkLegacyFiles, TheIronProteinIsWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("formats/vtk_legacy/ironProt.vtk"));
  const LoadedFile file = loadVtk(dataFile("formats/vtk_legacy/ironProt.vtk"));
  EXPECT_EQ(file.grid.dims, glm::ivec3(68));
  EXPECT_EQ(file.grid.worldFromVoxel, glm::dmat4(1.0));
  EXPECT_EQ(file.channels[0].voxels.type(), ScalarType::u8);
  EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, 255.0));
  EXPECT_EQ(vtkSum(file.channels[0]), 4131089);
}

TEST(VtkLegacyFiles, OtherGridsAreRefusedInWords) {
  SKIP_WITHOUT(dataFile("formats/vtk_legacy/RectGrid2.vtk"));
  EXPECT_THAT(loadError(dataFile("formats/vtk_legacy/RectGrid2.vtk")),
              AllOf(HasSubstr("z coordinates: expected even steps, found steps from 0.05 to 0.1"),
                    HasSubstr("uneven axes cannot be shown yet")));
  EXPECT_THAT(loadError(dataFile("formats/vtk_legacy/structured_grid.vtk")),
              HasSubstr("curved grids cannot be shown yet"));
  for (const char* name : {"VTKCellTypes.vtk", "hexa.vtk", "post.vtk"})
    EXPECT_THAT(loadError(dataFile(std::string("formats/vtk_unstructured/") + name)),
                HasSubstr("unstructured grids cannot be shown yet"));
}

TEST(VtkLegacyFiles, EveryTypeLoadsAsTextAndAsBytes) {
  const TempDir folder;
  const auto check = [&]<class T>(T highest, const std::string& type) {
    SCOPED_TRACE(type);
    std::vector<T> numbers{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, highest};
    std::string text;
    VtkValues expected;
    for (const T number : numbers) {
      text += std::to_string(number) + " ";
      expected.push_back(double(float(number)));
    }
    const std::string head = "POINT_DATA 12\nSCALARS a " + type + " 1\nLOOKUP_TABLE default\n";
    EXPECT_EQ(valuesOf(loadVtk(writeBytes(folder / "a.vtk", vtkLegacyText(head + text))).channels[0]),
              expected);
    const std::string bytes = vtkLegacyText(head + bytesOf(numbers, true) + "\n", "BINARY");
    EXPECT_EQ(valuesOf(loadVtk(writeBytes(folder / "a.vtk", bytes)).channels[0]), expected);
  };
  check(std::uint8_t(255), "unsigned_char");
  check(std::int8_t(-128), "char");
  check(std::uint16_t(65535), "unsigned_short");
  check(std::int16_t(-32768), "short");
  check(std::uint32_t(4000000000), "unsigned_int");
  check(std::int32_t(-2000000000), "int");
  check(std::uint64_t(1) << 63, "unsigned_long");
  check(-(std::int64_t(1) << 62), "long");
  check(std::int64_t(1) << 62, "vtktypeint64");
  check(std::int32_t(77), "vtkIdType");
  check(0.5f, "float");
  check(-0.25, "double");
}

TEST(VtkLegacyFiles, BitsAreEightInAByte) {
  const TempDir folder;
  const std::string head = "POINT_DATA 12\nSCALARS a bit\nLOOKUP_TABLE default\n";
  const VtkValues expected{1, 0, 1, 0, 0, 0, 0, 1, 0, 1, 1, 0};
  const std::string tail = "VECTORS v unsigned_char\n" + std::string(36, '\7');
  const LoadedFile file =
      loadVtk(writeBytes(folder / "a.vtk", vtkLegacyText(head + "\xA1\x60" + tail, "BINARY")));
  EXPECT_EQ(valuesOf(file.channels[0]), expected);
  EXPECT_EQ(valuesOf(file.channels.at(3)), VtkValues(12, 7)) << "the next array begins with a whole byte";
  EXPECT_EQ(
      valuesOf(
          loadVtk(writeBytes(folder / "a.vtk", vtkLegacyText(head + "1 0 1 0 0 0 0 1 0 1 1 0"))).channels[0]),
      expected);
}

TEST(VtkLegacyFiles, EveryKindOfArrayIsChannels) {
  const TempDir folder;
  std::vector<std::string> warnings;
  const std::string two = kVtkTwelve + kVtkTwelve, three = two + kVtkTwelve;
  const std::string data =
      "FIELD FieldData 2\nTIME 1 1 double\n0.5\nlabels 1 2 string\nfirst%20one\nsecond\n"
      "POINT_DATA 12\nSCALARS two%20words int 2\nLOOKUP_TABLE mine\n" +
      two + "LOOKUP_TABLE mine 2\n0 0 0 1 1 1 1 1\nVECTORS v float\n" + three +
      "METADATA\nINFORMATION 1\nNAME x\n\n" + "NORMALS n float\n" + three +
      "TEXTURE_COORDINATES t 2 float\n" + two + "TENSORS s float\n" + three + three + three +
      "COLOR_SCALARS c 1\n" + kVtkTwelve + "FIELD more 3\nf 1 12 short\n" + kVtkTwelve +
      "METADATA\nCOMPONENT_NAMES\nx\n\ng 2 12 float\n" + two + "short 1 3 int\n1 2 3\n" +
      "CELL_DATA 2\nSCALARS on_cells double\nLOOKUP_TABLE default\n0.5 1.5\n";
  const auto path = writeBytes(folder / "a.vtk", vtkLegacyText(data));
  const auto file = openFile(path, {.warn = [&](const std::string& line) { warnings.push_back(line); }});
  ASSERT_EQ(file->volumes.size(), 2u);
  std::vector<std::string> names;
  for (const ChannelInfo& channel : file->volumes[0].channels) names.push_back(channel.name);
  EXPECT_THAT(names, ElementsAre("two words X", "two words Y", "v X", "v Y", "v Z", "n X", "n Y", "n Z",
                                 "t X", "t Y", "s XX", "s XY", "s XZ", "s YX", "s YY", "s YZ", "s ZX", "s ZY",
                                 "s ZZ", "c", "f", "g X", "g Y"));
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("\"TIME\": of other length"), HasSubstr("\"labels\": of type"),
                                    HasSubstr("\"short\": of other length")));
  const LoadedPart points = load(*file, {.channels = {1, 20, 22}}, LoadOptions{});
  EXPECT_EQ(valuesOf(points.channels[0]), (VtkValues{2, 4, 6, 8, 10, 12, 2, 4, 6, 8, 10, 12}));
  EXPECT_EQ(valuesOf(points.channels[1]), vtkRamp(1, 12));
  EXPECT_EQ(points.channels[2].name, "g Y");
  const LoadedPart cells = load(*file, {.volume = 1}, LoadOptions{});
  EXPECT_EQ(cells.grid.dims, glm::ivec3(1, 2, 1));
  EXPECT_EQ(glm::dvec3(cells.grid.worldFromVoxel[3]), glm::dvec3(4.5, 6, 7.5));
  EXPECT_EQ(valuesOf(cells.channels[0]), (VtkValues{0.5, 1.5}));
}

TEST(VtkLegacyFiles, StringsInBinaryAreSkipped) {
  const TempDir folder;
  const std::string strings = std::string("\xC3") + "abc" + "\x80\x46" + std::string(70, 'x') +
                              std::string("\x40\0\0\2", 4) + "hi" + std::string("\0\0\0\0\0\0\0\1", 8) +
                              "z\n";
  const std::string data = "FIELD f 1\nwords 1 4 string\n" + strings +
                           "POINT_DATA 12\nSCALARS a char\nLOOKUP_TABLE default\n\1\2\3\4\5\6\7\1\2\3\4\5";
  const LoadedFile file = loadVtk(writeBytes(folder / "a.vtk", vtkLegacyText(data, "BINARY")));
  EXPECT_EQ(valuesOf(file.channels[0]), (VtkValues{1, 2, 3, 4, 5, 6, 7, 1, 2, 3, 4, 5}));
}

TEST(VtkLegacyFiles, RectilinearGridsWithEvenAxesLoad) {
  const TempDir folder;
  const auto grid = [](const std::string& y) {
    return "DATASET RECTILINEAR_GRID\nDIMENSIONS 2 3 2\nX_COORDINATES 2 float\n1 2\nY_COORDINATES 3 "
           "double\n" +
           y + "\nZ_COORDINATES 2 int\n-3 3\n";
  };
  const std::string data = "POINT_DATA 12\nSCALARS a float\nLOOKUP_TABLE default\n" + kVtkTwelve;
  const LoadedFile file = loadVtk(writeBytes(folder / "a.vtk", vtkLegacyText(data, "ascii", grid("5 7 9"))));
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(1, 2, 6));
  EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(1, 5, -3));
  EXPECT_EQ(valuesOf(file.channels[0]), vtkRamp(1, 12));
  EXPECT_THAT(loadError(writeBytes(folder / "a.vtk", vtkLegacyText(data, "ASCII", grid("5 7 8")))),
              HasSubstr("y coordinates: expected even steps, found steps from 1 to 2"));
  EXPECT_THAT(
      loadError(writeBytes(folder / "a.vtk",
                           vtkLegacyText(data, "ASCII", "DATASET RECTILINEAR_GRID\nDIMENSIONS 2 3 2\n"))),
      HasSubstr("X_COORDINATES: is missing"));
}

TEST(VtkLegacyFiles, LiesAreToldWithTheField) {
  const TempDir folder;
  const auto error = [&](const std::string& text) { return loadError(writeBytes(folder / "a.vtk", text)); };
  const auto withGrid = [&](const std::string& grid) {
    return error(vtkLegacyText("POINT_DATA 12\nSCALARS a float\nLOOKUP_TABLE default\n" + kVtkTwelve, "ASCII",
                               "DATASET STRUCTURED_POINTS\n" + grid));
  };
  const auto withData = [&](const std::string& data) { return error(vtkLegacyText(data)); };
  EXPECT_THAT(error("nothing"), HasSubstr("magic: expected # vtk DataFile Version, found \"nothing\""));
  EXPECT_THAT(error(vtkLegacyText("", "OCTAL")),
              HasSubstr("line 3: expected ASCII or BINARY, found \"OCTAL\""));
  EXPECT_THAT(error(vtkLegacyText("", "ASCII", "FIELD x 1\n")), HasSubstr("line 4: expected DATASET"));
  EXPECT_THAT(error(vtkLegacyText("", "ASCII", "DATASET POLYDATA\n")),
              HasSubstr("surfaces cannot be shown yet"));
  EXPECT_THAT(withGrid(""), HasSubstr("point_data: expected DIMENSIONS before it"));
  EXPECT_THAT(withGrid("DIMENSIONS 2 3\n"), HasSubstr("DIMENSIONS: expected 3 whole numbers"));
  EXPECT_THAT(withGrid("DIMENSIONS 2 3 -2\n"),
              HasSubstr("DIMENSIONS: expected a whole number, found \"-2\""));
  EXPECT_THAT(withGrid("DIMENSIONS 2 3 0\n"), HasSubstr("DIMENSIONS: expected sizes of at least 1"));
  EXPECT_THAT(withGrid("DIMENSIONS 60000 60000 60000\n"), HasSubstr("POINT_DATA: expected 216000000000000"));
  EXPECT_THAT(withGrid("DIMENSIONS 2 3 2\nSPACING 1 x 1\n"), HasSubstr("spacing: expected 3 finite numbers"));
  EXPECT_THAT(withGrid("DIMENSIONS 2 3 2\nORIGIN 1 inf 1\n"), HasSubstr("origin: expected 3 finite numbers"));
  EXPECT_THAT(withGrid("DIMENSIONS 2 3 2\nSPACING 0 1 1\n"), HasSubstr("singular"));
  EXPECT_THAT(withData("CELL_DATA 3\n"), HasSubstr("CELL_DATA: expected 2 by DIMENSIONS"));
  EXPECT_THAT(withData("SCALARS a float\nLOOKUP_TABLE x\n"), HasSubstr("expected POINT_DATA or CELL_DATA"));
  EXPECT_THAT(withData("POINT_DATA 12\n"), HasSubstr("expected arrays of numbers on points or cells"));
  EXPECT_THAT(withData("POINT_DATA 12\nSCALARS a float\n" + kVtkTwelve), HasSubstr("LOOKUP_TABLE behind it"));
  EXPECT_THAT(withData("POINT_DATA 12\nVECTORS a complex\n"), HasSubstr("expected a type of numbers"));
  EXPECT_THAT(withData("POINT_DATA 12\nPIXELS a float\n"), HasSubstr("keyword: expected one of the format"));
  EXPECT_THAT(withData("POINT_DATA 12\nSCALARS a float 0\n"), HasSubstr("1 to 4096 components"));
  EXPECT_THAT(withData("POINT_DATA 12\nFIELD f 1\na 9999999999 9999999999 float\n"), HasSubstr("1 to 4096"));
  EXPECT_THAT(withData("POINT_DATA 12\nFIELD f 1\na 4000 9223372036854775807 float\n"),
              HasSubstr("the file holds at most"));
  EXPECT_THAT(withData("POINT_DATA 12\nFIELD f 2\na 1 12 float\n" + kVtkTwelve),
              HasSubstr("FIELD: expected \"name components tuples type\" for each array"));
  EXPECT_THAT(withData("POINT_DATA 12\nFIELD f 1\na 1 99 string\nb\n"), HasSubstr("array of strings"));
  std::string few;
  for (int i = 0; i < 27; ++i) few += "100 ";
  EXPECT_THAT(withData("POINT_DATA 12\nVECTORS a char\n" + few),
              HasSubstr("array \"a\": expected 36 numbers, found \"27\""));
  EXPECT_THAT(withData("POINT_DATA 12\nGLOBAL_IDS a char\n1 2 3 4 5 6 7 8 9 1 2 300"),
              HasSubstr("found \"300\""));
}

TEST(VtkLegacyFiles, EveryTruncationIsHarmless) {
  const TempDir folder;
  const std::string whole = vtkLegacyText(
      "POINT_DATA 12\nSCALARS a short\nLOOKUP_TABLE default\n" + std::string(24, 'x'), "BINARY");
  ASSERT_EQ(loadError(writeBytes(folder / "a.vtk", whole)), "");
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(loadError(writeBytes(folder / "a.vtk", whole.substr(0, length))), "") << length;
}

}  // namespace
}  // namespace scolopax::io
