// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/vtk_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

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

}  // namespace
}  // namespace scolopax::io
