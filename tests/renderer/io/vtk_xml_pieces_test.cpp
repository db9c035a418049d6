// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/renderer/io/vtk_test_support.h"

namespace scolopax::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

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
  std::string diagonal;
  for (int k = 0; k < 410; ++k) {
    const std::string range = std::to_string(k) + " " + std::to_string(k + 1) + " ";
    diagonal += "<Piece Extent=\"" + range + range + range + "\"><PointData>" +
                vtkArrayText("UInt8", "a", "", "1 1 1 1 1 1 1 1") + "</PointData></Piece>";
  }
  const std::string whole = "<ImageData WholeExtent=\"0 410 0 410 0 410\">" + diagonal + "</ImageData>";
  EXPECT_THAT(loadError(writeBytes(folder / "a.vti", vtkFileText("ImageData", "", whole))),
              HasSubstr("expected pieces of a simple arrangement, found 410"));
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
