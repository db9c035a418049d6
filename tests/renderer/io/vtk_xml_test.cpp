// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/vtk_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

std::string vtkFileText(const std::string& type, const std::string& attributes, const std::string& inside,
                        const std::string& behind = "") {
  return "<?xml version=\"1.0\"?>\n<!-- a > b's -->\n<VTKFile type=\"" + type + "\" version=\"1.0\"" +
         attributes + ">\n" + inside + behind + "</VTKFile>\n";
}

std::string vtkArrayText(const std::string& type, const std::string& name, const std::string& more,
                         const std::string& text = "") {
  return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" " + more + ">\n  " + text +
         "\n</DataArray>\n";
}

/// An image of 2x3x2 points, whose arrays are `points` and `cells`.
std::string vtkImageText(const std::string& points, const std::string& cells = "",
                         const std::string& attributes = "") {
  return "<ImageData WholeExtent=\"0 1 0 2 0 1\" " + attributes +
         "><Piece Extent=\"0 1 0 2 0 1\"><PointData>" + points + "</PointData><CellData>" + cells +
         "</CellData></Piece></ImageData>";
}

TEST(VtkXmlFiles, ImagesOfTheCollectionAreWhatItStates) {
  SKIP_WITHOUT(dataFile("scalar/hydrogen.vti"));
  // The sums come from an independent decoder of zlib blocks in Python.
  const LoadedFile hydrogen = loadVtk(dataFile("scalar/hydrogen.vti"));
  EXPECT_EQ(hydrogen.grid.dims, glm::ivec3(64));
  EXPECT_EQ(hydrogen.grid.worldFromVoxel, glm::dmat4(1.0));
  EXPECT_THAT(vtkNames(hydrogen), ElementsAre("probability_density"));
  EXPECT_EQ(hydrogen.channels[0].voxels.type(), ScalarType::f32);
  EXPECT_EQ(rangeOf(hydrogen.channels[0]), std::pair(0.0, 1.0));
  EXPECT_NEAR(vtkSum(hydrogen.channels[0]), 4856.0089703339236, 1e-9);

  const LoadedFile embryo = loadVtk(dataFile("scalar/embryo_256.vti"));
  EXPECT_EQ(embryo.grid.dims, glm::ivec3(256));
  EXPECT_EQ(embryo.channels[0].voxels.type(), ScalarType::u8);
  EXPECT_EQ(rangeOf(embryo.channels[0]), std::pair(0.0, 197.0));
  EXPECT_EQ(vtkSum(embryo.channels[0]), 63724611);

  const LoadedFile vase = loadVtk(dataFile("formats/vtk_structured/vase_4comp.vti"));
  EXPECT_EQ(vase.grid.dims, glm::ivec3(115, 101, 75));
  EXPECT_THAT(vtkNames(vase), ElementsAre("Scalars_ 0", "Scalars_ 1", "Scalars_ 2", "Scalars_ 3"));
  double sum = 0;
  for (const ChannelSource& channel : vase.channels) {
    EXPECT_EQ(channel.voxels.type(), ScalarType::u8);
    EXPECT_EQ(rangeOf(channel), std::pair(0.0, 239.0));
    sum += vtkSum(channel);
  }
  EXPECT_EQ(sum, 42892524);

  const LoadedFile complex = loadVtk(dataFile("formats/vtk_encodings/volume_complex.vti"));
  EXPECT_EQ(complex.grid.dims, glm::ivec3(3, 4, 6));
  EXPECT_EQ(rangeOf(complex.channels[0]), std::pair(0.0, 50.0));
  EXPECT_EQ(vtkSum(complex.channels[0]), 900);
}

TEST(VtkXmlFiles, ViscousFingersAreWhatTheCollectionStates) {
  SKIP_WITHOUT(dataFile("timeseries/viscous_fingers"));
  struct Step {
    const char* name;
    double highest, sum;
  };
  for (const Step& step : {Step{"010", 90.45808410644531, 1247951.8557757703},
                           Step{"025", 103.0562744140625, 1940649.8518330231},
                           Step{"040", 113.59017181396484, 2608424.9275701591},
                           Step{"055", 110.99637603759766, 3257504.8552388661},
                           Step{"069", 116.20389556884766, 3734615.3367482251}}) {
    SCOPED_TRACE(step.name);
    const LoadedFile file =
        loadVtk(dataFile(std::string("timeseries/viscous_fingers/run01_density_") + step.name + ".vti"));
    EXPECT_EQ(file.grid.dims, glm::ivec3(64));
    EXPECT_THAT(vtkNames(file), ElementsAre("ImageFile"));
    EXPECT_EQ(rangeOf(file.channels[0]), std::pair(0.0, step.highest));
    EXPECT_NEAR(vtkSum(file.channels[0]), step.sum, 1e-6);
  }
}

TEST(VtkXmlFiles, OneRectilinearGridInFiveEncodingsIsTheSame) {
  SKIP_WITHOUT(dataFile("formats/vtk_encodings"));
  for (const char* name : {"_ascii", "InlineBinary", "AppendedBase64", "RawBinary", "Compressed"}) {
    SCOPED_TRACE(name);
    const LoadedFile file =
        loadVtk(dataFile(std::string("formats/vtk_encodings/RectilinearGrid") + name + ".vtr"));
    EXPECT_EQ(file.grid.dims, glm::ivec3(3, 1, 1));
    EXPECT_EQ(file.grid.spacing(), glm::dvec3(2, 1, 2));
    EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(-2, 0.5, 0)) << "the first cell's centre";
    EXPECT_THAT(vtkNames(file),
                ElementsAre("Pressure", "Void Volume Fraction", "X Velocity", "Y Velocity", "Z Velocity"));
    EXPECT_EQ(valuesOf(file.channels[1]), (VtkValues{1, 0.5, 1}));
    EXPECT_EQ(valuesOf(file.channels[2]), (VtkValues{0, 0, double(1.4f)}));
    EXPECT_EQ(valuesOf(file.channels[4]), (VtkValues{0, 0.5, 0}));
  }
}

TEST(VtkXmlFiles, BlocksOfTheAdaptiveGridLoadOneByOne) {
  SKIP_WITHOUT(dataFile("formats/vtk_amr/chombo3d"));
  double lowest = 0, highest = -1;
  for (int i = 0; i < 16; ++i) {
    const LoadedFile file =
        loadVtk(dataFile("formats/vtk_amr/chombo3d/chombo3d_" + std::to_string(i) + ".vti"));
    EXPECT_THAT(vtkNames(file), ElementsAre("phi"));
    const auto [low, high] = rangeOf(file.channels[0]);
    lowest = std::min(lowest, low);
    highest = std::max(highest, high);
    const double spacing = i == 0 ? 1 : i == 1 ? 0.5 : 0.25;
    EXPECT_EQ(file.grid.spacing(), glm::dvec3(spacing)) << i;
    EXPECT_EQ(file.grid.dims.x, i == 0 ? 8 : i == 1 ? 16 : i == 2 ? 12 : file.grid.dims.x);
    if (i == 13) {
      EXPECT_EQ(file.grid.dims, glm::ivec3(4));
      EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(5.125, 2.125, 2.125));
    }
  }
  EXPECT_EQ(lowest, double(float(-0.039193807322508545)));
  EXPECT_EQ(highest, double(float(-3.703356061678476e-05)));
}

TEST(VtkXmlFiles, GridsThatAreNotRegularAreRefusedInWords) {
  SKIP_WITHOUT(dataFile("multichannel/cth_impact/cth.vtr"));
  const auto error = [](const char* name) { return loadError(dataFile(name)); };
  EXPECT_THAT(error("multichannel/cth_impact/cth.vtr"),
              AllOf(HasSubstr("x coordinates: expected even steps, found steps from 0.07031 to 0.1094"),
                    HasSubstr("uneven axes cannot be shown yet")));
  EXPECT_THAT(error("formats/vtk_structured/StructuredGrid.vts"),
              HasSubstr("curved grids cannot be shown yet"));
  for (const char* name :
       {"vtk_unstructured/can.vtu", "vtk_unstructured/Tetrahedron.vtu", "vtk_unstructured/Hexahedron.vtu",
        "vtk_unstructured/notch_disp.vtu", "vtk_unstructured/polyhedron2pieces.vtu", "vtk_encodings/box.vtu",
        "vtk_encodings/hexahedron_ascii.vtu", "vtk_encodings/hexahedron_lz4.vtu",
        "vtk_encodings/hexahedron_lzma_inline_binary.vtu"})
    EXPECT_THAT(error((std::string("formats/") + name).c_str()),
                HasSubstr("unstructured grids cannot be shown yet"));
  EXPECT_THAT(error("formats/vtk_multiblock/ex-blow_5.vtm"),
              HasSubstr("a list of files: open them one by one"));
  EXPECT_THAT(error("formats/vtk_amr/chombo3d/chombo3d.vtm"),
              HasSubstr("grids of several resolutions cannot be shown yet"));
}

TEST(VtkXmlFiles, EveryCodingGivesTheSameNumbers) {
  const TempDir folder;
  int files = 0;
  for (const std::string packer : {"", "zlib", "lz4"}) {
    for (int variant = 0; variant < 16; ++variant) {
      const VtkCodingOfTest coding{.big = (variant & 1) != 0,
                                   .wide = (variant & 2) != 0,
                                   .packer = packer,
                                   .blockBytes = variant & 4 ? 8u : 1024u};
      const std::string a = vtkShorts(12, -5, coding.big), b = vtkShorts(24, 100, coding.big);
      std::string text;
      if (variant & 8) {
        text =
            vtkFileText("ImageData", coding.attributes(),
                        vtkImageText(vtkArrayText("Int16", "a", "format=\"binary\"", coding.text(a)) +
                                     vtkArrayText("Int16", "b", "NumberOfComponents=\"2\" format=\"binary\"",
                                                  coding.text(b))));
        files += writeBytes(folder / "a.vti", text).empty() ? 0 : 1;
      } else {
        for (const bool raw : {false, true}) {
          const std::string first = raw ? coding.raw(a) : coding.text(a),
                            second = raw ? coding.raw(b) : coding.text(b);
          text =
              vtkFileText("ImageData", coding.attributes(),
                          vtkImageText("<DataArray type='Int16' Name='a' format='appended' offset='0'/>" +
                                       vtkArrayText("Int16", "b",
                                                    "NumberOfComponents=\"2\" format=\"appended\" offset=\"" +
                                                        std::to_string(first.size()) + "\"")),
                          std::string("<AppendedData encoding=\"") + (raw ? "raw" : "base64") + "\">\n _" +
                              first + second + "\n</AppendedData>");
          ++files;
          const LoadedFile file = loadVtk(writeBytes(folder / "a.vti", text));
          EXPECT_EQ(valuesOf(file.channels.at(0)), vtkRamp(-5, 12)) << text;
        }
      }
      const LoadedFile file = loadVtk(writeBytes(folder / "a.vti", text));
      SCOPED_TRACE(text);
      EXPECT_EQ(file.grid.dims, glm::ivec3(2, 3, 2));
      ASSERT_THAT(vtkNames(file), ElementsAre("a", "b X", "b Y"));
      EXPECT_EQ(valuesOf(file.channels[0]), vtkRamp(-5, 12));
      EXPECT_EQ(valuesOf(file.channels[1]), vtkRamp(100, 12, 2));
      EXPECT_EQ(valuesOf(file.channels[2]), vtkRamp(101, 12, 2));
    }
  }
  EXPECT_EQ(files, 3 * (8 + 16));
}

TEST(VtkXmlFiles, EveryTypeLoadsAsTextAndAsBytes) {
  const TempDir folder;
  const auto check = [&]<class T>(T, const std::string& type, std::vector<T> numbers) {
    SCOPED_TRACE(type);
    std::string text;
    VtkValues expected;
    for (const T number : numbers) {
      char word[40];
      if constexpr (std::is_floating_point_v<T>)
        std::snprintf(word, sizeof word, "%.17g", double(number));
      else
        std::snprintf(word, sizeof word, "%s", std::to_string(number).c_str());
      text += std::string(word) + (expected.size() % 3 == 0 ? "\n" : "  ");
      expected.push_back(double(float(number)));
    }
    const VtkCodingOfTest coding;
    const LoadedFile file = loadVtk(writeBytes(
        folder / "a.vti", vtkFileText("ImageData", coding.attributes(),
                                      vtkImageText(vtkArrayText(type, "text", "format=\"ascii\"", text) +
                                                   vtkArrayText(type, "bytes", "format=\"binary\"",
                                                                coding.text(bytesOf(numbers)))))));
    EXPECT_EQ(valuesOf(file.channels[0]), expected);
    EXPECT_EQ(valuesOf(file.channels[1]), expected);
  };
  check(std::int8_t(), "Int8", {-128, -1, 0, 1, 2, 3, 4, 5, 6, 7, 8, 127});
  check(std::uint8_t(), "UInt8", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 128, 255});
  check(std::int16_t(), "Int16", {-32768, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 32767});
  check(std::uint16_t(), "UInt16", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 65535});
  check(std::int32_t(), "Int32", {-40000, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1 << 30});
  check(std::uint32_t(), "UInt32", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 3u << 30});
  check(std::int64_t(), "Int64", {-(1ll << 60), 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1ll << 62});
  check(std::uint64_t(), "UInt64", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1ull << 63});
  check(float(), "Float32", {-1.5f, 1e-30f, 0, 1, 2, 3, 4, 5, 6, 7, 8, 1e30f});
  check(double(), "Float64", {-1.5, 1e-30, 0, 1, 2, 3, 4, 5, 6, 7, 0.1, 1e30});
}

TEST(VtkXmlFiles, CellsLieHalfAStepFurtherInThanPoints) {
  const TempDir folder;
  const auto path = writeBytes(
      folder / "a.vti",
      vtkFileText(
          "ImageData", "",
          "<ImageData WholeExtent=\"2 4 0 1 7 7\" Origin=\"10 20 30\" Spacing=\"2 3 4\" "
          "Direction=\"0 -1 0 1 0 0 0 0 1\"><Piece Extent=\"2 4 0 1 7 7\"><FieldData>" +
              vtkArrayText("Float64", "TimeValue", "format=\"ascii\"", "7") + "</FieldData><PointData>" +
              vtkArrayText("UInt8", "p", "format=\"ascii\"", "1 2 3 4 5 6") + "</PointData><CellData>" +
              vtkArrayText("UInt8", "c", "format=\"ascii\"", "7 8") + "</CellData></Piece></ImageData>"));
  const auto file = openFile(path);
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_EQ(file->volumes[0].path, "points");
  EXPECT_EQ(file->volumes[1].path, "cells");
  const LoadedPart points = scolopax::io::load(*file, {.volume = 0}, LoadOptions{}),
                   cells = scolopax::io::load(*file, {.volume = 1}, LoadOptions{});
  EXPECT_EQ(points.grid.dims, glm::ivec3(3, 2, 1));
  EXPECT_EQ(cells.grid.dims, glm::ivec3(2, 1, 1)) << "a flat axis has one layer of cells";
  EXPECT_EQ(valuesOf(points.channels[0]), vtkRamp(1, 6));
  EXPECT_EQ(valuesOf(cells.channels[0]), vtkRamp(7, 2));
  for (const Grid& grid : {points.grid, cells.grid}) {
    EXPECT_EQ(glm::dvec3(grid.worldFromVoxel[0]), glm::dvec3(0, 2, 0)) << "Direction is row by row";
    EXPECT_EQ(glm::dvec3(grid.worldFromVoxel[1]), glm::dvec3(-3, 0, 0));
    EXPECT_EQ(glm::dvec3(grid.worldFromVoxel[2]), glm::dvec3(0, 0, 4));
  }
  EXPECT_EQ(glm::dvec3(points.grid.worldFromVoxel[3]), glm::dvec3(10, 24, 58));
  EXPECT_EQ(glm::dvec3(cells.grid.worldFromVoxel[3]), glm::dvec3(10 - 1.5, 24 + 1, 58));
}

TEST(VtkXmlFiles, ComponentsAreNamedAndStringsAreLeftOut) {
  const TempDir folder;
  std::vector<std::string> warnings;
  const std::string numbers = "1 1 1 1 1 1 1 1 1 1 1 1 ";
  const std::string twelve = numbers + numbers + numbers;
  const auto path = writeBytes(
      folder / "a.vti",
      vtkFileText(
          "ImageData", "",
          vtkImageText(
              vtkArrayText("UInt8", "v", "NumberOfComponents=\"3\"", twelve) +
              vtkArrayText("UInt8", "named",
                           "NumberOfComponents=\"2\" ComponentName0=\"re\" ComponentName1=\"im\"", twelve) +
              vtkArrayText("UInt8", "stress", "NumberOfComponents=\"6\"", twelve + twelve) +
              vtkArrayText("UInt8", "vtkGhostType", "", numbers) + vtkArrayText("Bit", "flags", "", numbers) +
              "<Array type=\"String\" Name=\"words\" format=\"ascii\">65 0</Array>")));
  const LoadedFile file =
      loadFile(path, kTestLimit, [&](const std::string& line) { warnings.push_back(line); });
  EXPECT_THAT(vtkNames(file), ElementsAre("v X", "v Y", "v Z", "named re", "named im", "stress XX",
                                          "stress YY", "stress ZZ", "stress XY", "stress YZ", "stress XZ"));
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("\"vtkGhostType\": is left out"),
                                    HasSubstr("\"flags\": of type \"Bit\", is left out"),
                                    HasSubstr("\"words\": of type \"String\", is left out")));
}

/// A piece of a 4x2x2 image or grid, whose points have the values x + 4 * y + 8 * z.
std::string vtkPieceText(int first, int last, const std::string& more = "") {
  std::string numbers;
  for (int row = 0; row < 4; ++row)
    for (int x = first; x <= last; ++x) numbers += std::to_string(x + 4 * row) + " ";
  return "<Piece Extent=\"" + std::to_string(first) + " " + std::to_string(last) + " 0 1 0 1\"><PointData>" +
         vtkArrayText("Int32", "a", "", numbers) + "</PointData>" + more + "</Piece>";
}

TEST(VtkXmlFiles, PiecesAreJoined) {
  const TempDir folder;
  const auto loadPieces = [&](const std::string& pieces) {
    return loadVtk(writeBytes(
        folder / "a.vti",
        vtkFileText("ImageData", "", "<ImageData WholeExtent=\"0 3 0 1 0 1\">" + pieces + "</ImageData>")));
  };
  EXPECT_EQ(valuesOf(loadPieces(vtkPieceText(0, 1) + vtkPieceText(1, 3)).channels[0]), vtkRamp(0, 16));
  EXPECT_EQ(valuesOf(loadPieces(vtkPieceText(2, 3) + vtkPieceText(0, 2)).channels[0]), vtkRamp(0, 16));
  EXPECT_EQ(valuesOf(loadPieces("<Piece Extent=\"0 -1 0 -1 0 -1\"/>" + vtkPieceText(0, 3)).channels[0]),
            vtkRamp(0, 16))
      << "an idle process leaves an empty piece";
  const auto error = [&](const std::string& pieces) { return errorOf([&] { loadPieces(pieces); }); };
  EXPECT_THAT(error(vtkPieceText(0, 1) + vtkPieceText(3, 3)),
              HasSubstr("cover the whole extent, found some of it missing"));
  EXPECT_THAT(error(vtkPieceText(0, 4)),
              HasSubstr("Extent: expected indices of x from 0 to 3, found 0 to 4"));
  EXPECT_THAT(error(""), HasSubstr("expected a piece, found none"));
  EXPECT_THAT(error(vtkPieceText(0, 2) + "<Piece Extent=\"2 3 0 1 0 1\"/>"),
              HasSubstr("array \"a\": expected it in every piece"));
  std::string other = vtkPieceText(2, 3);
  other.replace(other.find("Int32"), 5, "Int16");
  EXPECT_THAT(error(vtkPieceText(0, 2) + other), HasSubstr("expected one type and number of components"));
  std::string many;
  for (int i = 0; i < 300; ++i) many += vtkPieceText(0, 3);
  EXPECT_THAT(error(many), HasSubstr("expected pieces that overlap little"));
}

TEST(VtkXmlFiles, AParallelFileNamesItsPieces) {
  const TempDir folder;
  std::filesystem::create_directory(folder / "parts");
  for (int i = 0; i < 2; ++i)
    writeBytes(folder / ("parts/" + std::to_string(i) + ".vti"),
               vtkFileText("ImageData", "",
                           std::string("<ImageData WholeExtent=\"") + (i ? "1 3" : "0 1") + " 0 1 0 1\">" +
                               vtkPieceText(i ? 1 : 0, i ? 3 : 1) + "</ImageData>"));
  const auto parallel = [&](const std::string& second) {
    return writeBytes(folder / "a.pvti",
                      vtkFileText("PImageData", "",
                                  "<PImageData WholeExtent=\"0 3 0 1 0 1\" Spacing=\"1 2 3\"><Piece "
                                  "Source=\"parts/0.vti\"/><Piece Source=\"" +
                                      second + "\"/></PImageData>"));
  };
  const auto path = parallel("parts/1.vti");
  EXPECT_EQ(valuesOf(loadVtk(path).channels[0]), vtkRamp(0, 16));
  EXPECT_EQ(loadVtk(path).grid.spacing(), glm::dvec3(1, 2, 3));
  EXPECT_THAT(openFile(path)->dataFiles, ElementsAre(folder / "parts/0.vti", folder / "parts/1.vti"));
  EXPECT_THAT(loadError(parallel("parts/0.vti")), HasSubstr("Source: expected every file once"));
  EXPECT_THAT(loadError(parallel("../1.vti")), HasSubstr("in or below the header's folder"));
  EXPECT_THAT(loadError(parallel("a.pvti")), HasSubstr("type: expected ImageData, found \"PImageData\""));
  EXPECT_THAT(loadError(parallel("gone.vti")), HasSubstr("names \"gone.vti\", which is not in"));
}

std::string vtkCoordinatesText(const std::string& x) {
  return "<Coordinates>" + vtkArrayText("Float64", "x", "", x) + vtkArrayText("Float32", "y", "", "1 3") +
         vtkArrayText("Int32", "z", "", "-1 2") + "</Coordinates>";
}

TEST(VtkXmlFiles, AxesAreEvenWithinAThousandthOfAStep) {
  const TempDir folder;
  const auto loadAxis = [&](const std::string& x, int last = 3) {
    return loadVtk(writeBytes(folder / "a.vtr", vtkFileText("RectilinearGrid", "",
                                                            "<RectilinearGrid WholeExtent=\"0 3 0 1 0 1\">" +
                                                                vtkPieceText(0, last, vtkCoordinatesText(x)) +
                                                                "</RectilinearGrid>")));
  };
  const LoadedFile file = loadAxis("0.5 2.501 4.499 6.5");
  EXPECT_EQ(file.grid.spacing(), glm::dvec3(2, 2, 3));
  EXPECT_EQ(glm::dvec3(file.grid.worldFromVoxel[3]), glm::dvec3(0.5, 1, -1));
  EXPECT_EQ(valuesOf(file.channels[0]), vtkRamp(0, 16));
  EXPECT_EQ(loadAxis("6 4 2 0").grid.worldFromVoxel[0].x, -2);
  const auto error = [&](const std::string& x) { return errorOf([&] { loadAxis(x); }); };
  EXPECT_THAT(error("0.5 2.503 4.5 6.5"), HasSubstr("x coordinates: expected even steps, found steps from"));
  EXPECT_THAT(error("0 1 0 3"), HasSubstr("x coordinates: expected numbers that all increase"));
  EXPECT_THAT(error("0 0 0 0"), HasSubstr("x coordinates: expected numbers that all increase"));
  EXPECT_THAT(error("0 1 nan 3"), HasSubstr("x coordinates: expected a finite number for every point"));
  EXPECT_THAT(error("0 1 2"),
              HasSubstr("array \"x\": expected numbers of type float64, found \"their end\""));
  EXPECT_THAT(errorOf([&] { loadAxis("0 1 2", 2); }), HasSubstr("a finite number for every point"));
}

TEST(VtkXmlFiles, PiecesOfARectilinearGridBringTheirCoordinates) {
  const TempDir folder;
  const auto path =
      writeBytes(folder / "a.vtr",
                 vtkFileText("RectilinearGrid", "",
                             "<RectilinearGrid WholeExtent=\"0 3 0 1 0 1\">" +
                                 vtkPieceText(0, 1, vtkCoordinatesText("0 2")) +
                                 vtkPieceText(1, 3, vtkCoordinatesText("2 4 6")) + "</RectilinearGrid>"));
  EXPECT_EQ(loadVtk(path).grid.spacing(), glm::dvec3(2, 2, 3));
  EXPECT_EQ(valuesOf(loadVtk(path).channels[0]), vtkRamp(0, 16));
}

TEST(VtkXmlFiles, LiesAreToldWithTheField) {
  const TempDir folder;
  const auto error = [&](const std::string& text) { return loadError(writeBytes(folder / "a.vti", text)); };
  const auto withImage = [&](const std::string& array, const std::string& attributes = "") {
    return error(vtkFileText("ImageData", attributes, vtkImageText(array)));
  };
  const VtkCodingOfTest plain, zlib{.packer = "zlib"};
  const auto binary = [&](const std::string& bytes) {
    return vtkArrayText("Int16", "a", "format=\"binary\"", base64(bytes));
  };
  EXPECT_THAT(error("<VTKFile"), HasSubstr("expected XML with an element VTKFile"));
  EXPECT_THAT(error("<VTKFile/>"), HasSubstr("type: is missing in VTKFile"));
  EXPECT_THAT(error(vtkFileText("ImageData", "", "")), HasSubstr("expected the element ImageData"));
  EXPECT_THAT(error(vtkFileText("ImageData", "", "<ImageData/>")), HasSubstr("WholeExtent: is missing"));
  for (const char* extent : {"0 1 2", "0 1 2 3 4 x", "0 9999999999 0 1 0 1"})
    EXPECT_THAT(
        error(vtkFileText("ImageData", "", std::string("<ImageData WholeExtent=\"") + extent + "\"/>")),
        HasSubstr("WholeExtent: expected 6 whole numbers"));
  EXPECT_THAT(withImage("", " byte_order=\"Middle\""), HasSubstr("byte_order: expected LittleEndian"));
  EXPECT_THAT(withImage("", " header_type=\"UInt16\""), HasSubstr("header_type: expected UInt32 or UInt64"));
  EXPECT_THAT(withImage("", " compressor=\"vtkLZMADataCompressor\""),
              HasSubstr("compressor: expected that of zlib or LZ4, found \"vtkLZMADataCompressor\""));
  EXPECT_THAT(withImage(""), HasSubstr("expected arrays of numbers on points or cells, found none"));
  EXPECT_THAT(withImage(vtkArrayText("Int16", "a", "NumberOfComponents=\"0\"")), HasSubstr("from 1 to 4096"));
  EXPECT_THAT(withImage(vtkArrayText("Int16", "a", "format=\"hex\"")), HasSubstr("format ascii, binary or"));
  EXPECT_THAT(withImage(vtkArrayText("Int16", "a", "format=\"appended\" offset=\"1\"")),
              HasSubstr("an offset within"));
  EXPECT_THAT(withImage(vtkArrayText("Int16", "a", "", "1 2 3 4 5 6 7 8 9 10 11 x")),
              HasSubstr("array \"a\": expected numbers of type int16, found \"x\""));
  EXPECT_THAT(withImage(vtkArrayText("Int8", "a", "", "1 2 3 4 5 6 7 8 9 10 11 128")),
              HasSubstr("found \"128\""));
  EXPECT_THAT(withImage(vtkArrayText("Int16", "a", "", "1 2 3")), HasSubstr("the file holds at most"));
  EXPECT_THAT(withImage(binary(plain.size(24) + std::string(10, 'x'))), HasSubstr("the file holds at most"));
  EXPECT_THAT(withImage(binary(plain.size(26) + vtkShorts(13))),
              HasSubstr("expected 24 bytes, found 26 bytes"));
  EXPECT_THAT(withImage(vtkArrayText("Int16", "a", "format=\"binary\"", std::string(40, '*'))),
              HasSubstr("expected base64 data, found \"*\""));
  const auto packed = [&](const std::string& sizes, const std::string& blocks) {
    return withImage(vtkArrayText("Int16", "a", "format=\"binary\"", base64(sizes) + base64(blocks)),
                     zlib.attributes());
  };
  const auto [sizes, blocks] = zlib.parts(vtkShorts(12));
  EXPECT_EQ(packed(sizes, blocks), "");
  const auto four = [&](std::uint64_t a, std::uint64_t b, std::uint64_t c, std::uint64_t d) {
    return packed(plain.size(a) + plain.size(b) + plain.size(c) + plain.size(d), blocks);
  };
  EXPECT_THAT(four(1, 16, 0, 9), HasSubstr("expected 24 bytes, found 16 bytes"));
  EXPECT_THAT(four(0, 24, 0, 9), HasSubstr("expected 24 bytes, found 0 bytes"));
  EXPECT_THAT(four(24, 1, 0, 9), HasSubstr("expected 24 compressed blocks, the file holds only"));
  EXPECT_THAT(four(1, 24, 0, 0xFFFFFFFF), HasSubstr("expected a compressed block of 4294967295 bytes"));
  EXPECT_THAT(four(1, 24, 0, 5), HasSubstr("expected a compressed block of 24 bytes, found damaged data"));
  EXPECT_THAT(four(2, 0, 24, 1), HasSubstr("a last block that is not larger"));
  std::string damaged = blocks;
  damaged[5] = char(damaged[5] ^ 0x55);
  EXPECT_THAT(packed(sizes, damaged), HasSubstr("found damaged data"));
  const std::string large =
      "<ImageData WholeExtent=\"0 60000 0 60000 0 60000\"><Piece Extent=\"0 60000 0 60000 0 "
      "60000\"><PointData>";
  EXPECT_THAT(error(vtkFileText("ImageData", zlib.attributes(),
                                large + binary(blocks) + "</PointData></Piece></ImageData>")),
              HasSubstr("the file holds at most"));
}

TEST(VtkXmlFiles, EveryTruncationIsHarmless) {
  const TempDir folder;
  for (const std::string packer : {"", "zlib"}) {
    const VtkCodingOfTest coding{.packer = packer};
    const std::string data = coding.raw(vtkShorts(12));
    const std::string appended =
        vtkFileText("ImageData", coding.attributes(),
                    vtkImageText("<DataArray type=\"Int16\" format=\"appended\" offset=\"0\"/>"),
                    "<AppendedData encoding=\"raw\">_" + data);
    const std::size_t end = appended.size() - std::string("</VTKFile>\n").size();
    const std::string inlined =
        vtkFileText("ImageData", coding.attributes(),
                    vtkImageText(vtkArrayText("Int16", "", "format=\"binary\"", coding.text(vtkShorts(12)))));
    ASSERT_EQ(loadError(writeBytes(folder / "a.vti", appended.substr(0, end))), "");
    for (std::size_t length = 0; length < end; length += length + 80 < end ? 3 : 1)
      EXPECT_NE(loadError(writeBytes(folder / "a.vti", appended.substr(0, length))), "") << length;
    ASSERT_EQ(loadError(writeBytes(folder / "a.vti", inlined)), "");
    for (std::size_t length = 0; length + 2 < inlined.size(); length += 3)
      EXPECT_NE(loadError(writeBytes(folder / "a.vti", inlined.substr(0, length))), "") << length;
  }
}

TEST(VtkXmlFiles, ABombNeedsNoMoreMemoryThanTheLimit) {
  const TempDir folder;
  const VtkCodingOfTest coding{.packer = "zlib", .blockBytes = 64 << 20};
  const std::string text = vtkFileText(
      "ImageData", coding.attributes(),
      "<ImageData WholeExtent=\"0 1023 0 255 0 255\"><Piece Extent=\"0 1023 0 255 0 255\"><PointData>"
      "<DataArray type=\"UInt8\" format=\"appended\" offset=\"0\"/></PointData></Piece></ImageData>",
      "<AppendedData encoding=\"raw\">_" + coding.raw(std::string(64 << 20, '\0')));
  const auto path = writeBytes(folder / "a.vti", text);
  EXPECT_THAT(loadError(path, (64 << 20) - 1), HasSubstr("the limit is 67108863 bytes"));
  EXPECT_THAT(loadError(path, 64 << 20), HasSubstr("a compressed block needs"));
  EXPECT_EQ(loadError(path, 65 << 20), "");
}

TEST(VtkXmlFiles, AreFoundByWhatTheyContain) {
  const TempDir folder;
  const std::string text =
      vtkFileText("ImageData", "", vtkImageText(vtkArrayText("UInt8", "a", "", "1 2 3 4 5 6 7 8 9 1 2 3")));
  EXPECT_EQ(valuesOf(loadVtk(writeBytes(folder / "x.xml", text)).channels[0])[8], 9);
  EXPECT_THAT(loadError(writeBytes(folder / "a.vtp", "nothing")), HasSubstr("expected XML"));
}

}  // namespace
}  // namespace scolopax::io
