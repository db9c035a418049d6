// SPDX-License-Identifier: Apache-2.0
// VTK's XML files of regular grids (docs.vtk.org, VTK File Formats): ImageData, and RectilinearGrid with even
// axes, in one file or in pieces that a parallel file names.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/vtk_dataset.h"
#include "renderer/io/vtk_markup.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMostVtkPieces = 1 << 16;

std::optional<StoredType> vtkXmlType(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, StoredType>, 10> kTypes{
      {{"Int8", StoredType::i8},
       {"UInt8", StoredType::u8},
       {"Int16", StoredType::i16},
       {"UInt16", StoredType::u16},
       {"Int32", StoredType::i32},
       {"UInt32", StoredType::u32},
       {"Int64", StoredType::i64},
       {"UInt64", StoredType::u64},
       {"Float32", StoredType::f32},
       {"Float64", StoredType::f64}}};
  const auto found = std::ranges::find(kTypes, name, &std::pair<std::string_view, StoredType>::first);
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

/// "FILE: NAME" for messages about an attribute.
std::string vtkField(const VtkMarkup& markup, const char* name) { return markup.file + ": " + name; }

std::string_view vtkAttribute(const VtkMarkup& markup, const pugi::xml_node& element, const char* name) {
  const pugi::xml_attribute attribute = element.attribute(name);
  if (!attribute)
    throw Error(ErrorCode::badInput, vtkField(markup, name) + ": is missing in " + element.name());
  return attribute.value();
}

/// The numbers of an attribute, or `otherwise` without it.
template <std::size_t N>
std::array<double, N> vtkNumbers(const VtkMarkup& markup, const pugi::xml_node& element, const char* name,
                                 std::array<double, N> otherwise) {
  if (!element.attribute(name)) return otherwise;
  const std::string_view text = element.attribute(name).value();
  const auto words = splitWords(text);
  bool good = words.size() == N;
  for (std::size_t i = 0; good && i < N; ++i) {
    const auto number = parseNumber(words[i]);
    good = number && std::isfinite(*number);
    if (good) otherwise[i] = *number;
  }
  if (!good) throw badVtk(vtkField(markup, name), std::to_string(N) + " finite numbers", text);
  return otherwise;
}

VtkExtent vtkExtent(const VtkMarkup& markup, const pugi::xml_node& element, const char* name) {
  constexpr std::int64_t kFarthest = std::int64_t(1) << 31;
  const std::string_view text = vtkAttribute(markup, element, name);
  const auto words = splitWords(text);
  VtkExtent extent;
  for (int i = 0; i < 6; ++i) {
    const auto number = words.size() == 6 ? parseInteger(words[std::size_t(i)]) : std::nullopt;
    if (!number || *number < -kFarthest || *number > kFarthest)
      throw badVtk(vtkField(markup, name), "6 whole numbers: the first and last index of x, y and z", text);
    (i % 2 == 0 ? extent.first : extent.last)[i / 2] = *number;
  }
  return extent;
}

/// What holds for all arrays of a file.
VtkArray vtkArrayDefaults(const VtkMarkup& markup, const fs::path& path) {
  const pugi::xml_node root = markup.root();
  VtkArray array{.file = markup.file, .path = path};
  const std::string_view order = root.attribute("byte_order").as_string("LittleEndian");
  if (order != "LittleEndian" && order != "BigEndian")
    throw badVtk(vtkField(markup, "byte_order"), "LittleEndian or BigEndian", order);
  array.bigEndian = order == "BigEndian";
  const std::string_view header = root.attribute("header_type").as_string("UInt32");
  if (header != "UInt32" && header != "UInt64")
    throw badVtk(vtkField(markup, "header_type"), "UInt32 or UInt64", header);
  array.headerBytes = header == "UInt64" ? 8 : 4;
  const std::string_view compressor = root.attribute("compressor").as_string("");
  if (compressor == "vtkZLibDataCompressor") {
    array.compressor = VtkCompressor::zlib;
  } else if (compressor == "vtkLZ4DataCompressor") {
    array.compressor = VtkCompressor::lz4;
#if !SCOLOPAX_HAS_LZ4
    throw Error(ErrorCode::unsupported, markup.file + ": compressor: LZ4 needs the library of " +
                                            SCOLOPAX_LACKS_LZ4 + ", without which this program was built");
#endif
  } else if (!compressor.empty()) {
    throw unsupportedVtk(vtkField(markup, "compressor"), "that of zlib or LZ4", compressor);
  }
  return array;
}

/// Where the numbers of an array are.
void locateVtkArray(const VtkMarkup& markup, const pugi::xml_node& element, VtkArray& array) {
  const std::string_view format = element.attribute("format").as_string("ascii");
  if (format == "ascii" || format == "binary") {
    const VtkText text = VtkMarkup::textOf(element);
    array.begin = text.begin;
    array.end = text.end;
    array.coding = format == "ascii" ? VtkCoding::ascii : VtkCoding::base64;
    return;
  }
  if (format != "appended") throw badVtk(array.where(), "format ascii, binary or appended", format);
  const std::string_view encoding =
      markup.root().child("AppendedData").attribute("encoding").as_string("base64");
  if (encoding != "raw" && encoding != "base64")
    throw badVtk(vtkField(markup, "AppendedData"), "encoding raw or base64", encoding);
  array.coding = encoding == "raw" ? VtkCoding::raw : VtkCoding::base64;
  const std::string_view offset = vtkAttribute(markup, element, "offset");
  const auto number = parseInteger(offset);
  const std::uint64_t size = markup.appended().end - markup.appended().begin;
  if (!number || *number < 0 || std::uint64_t(*number) > size)
    throw badVtk(array.where(), "an offset within the " + byteCount(size) + " of AppendedData", offset);
  array.begin = markup.appended().begin + std::uint64_t(*number);
  array.end = markup.appended().end;
}

VtkArray vtkXmlArray(const VtkMarkup& markup, const pugi::xml_node& element, const VtkArray& defaults,
                     StoredType type) {
  constexpr std::int64_t kMostComponents = 4096;
  VtkArray array = defaults;
  array.name = element.attribute("Name").as_string("");
  array.type = type;
  const std::string_view components = element.attribute("NumberOfComponents").as_string("1");
  const auto count = parseInteger(trimmed(components));
  if (!count || *count < 1 || *count > kMostComponents)
    throw unsupportedVtk(array.where(), "NumberOfComponents from 1 to 4096", components);
  array.components = std::size_t(*count);
  for (std::size_t i = 0; i < array.components; ++i) {
    const pugi::xml_attribute name = element.attribute(("ComponentName" + std::to_string(i)).c_str());
    if (!name) break;
    array.componentNames.emplace_back(name.value());
  }
  locateVtkArray(markup, element, array);
  return array;
}

/// The arrays of PointData or CellData that hold quantities.
std::vector<VtkArray> vtkXmlArrays(const VtkMarkup& markup, const pugi::xml_node& data,
                                   const VtkArray& defaults, const Warn& warn) {
  std::vector<VtkArray> arrays;
  for (const pugi::xml_node& element : data.children()) {
    const std::string_view tag = element.name(), name = element.attribute("Name").as_string("");
    if (tag != "DataArray" && tag != "Array") continue;
    const std::string_view typeName = element.attribute("type").as_string("");
    const auto type = vtkXmlType(typeName);
    if (name == "vtkGhostType" || name == "vtkGhostLevels") {
      warn(markup.file + ": array " + inQuotes(name) + ": is left out");
    } else if (type && tag == "DataArray") {
      arrays.push_back(vtkXmlArray(markup, element, defaults, *type));
    } else {
      warn(markup.file + ": array " + inQuotes(name) + ": of type " + inQuotes(typeName) + ", is left out");
    }
  }
  return arrays;
}

/// Adds the pieces of a file that holds them itself.
void addVtkXmlPieces(const VtkMarkup& markup, const fs::path& path, const pugi::xml_node& grid,
                     std::vector<VtkPiece>& pieces, const Warn& warn) {
  const VtkArray defaults = vtkArrayDefaults(markup, path);
  const bool rectilinear = std::string_view(grid.name()) == "RectilinearGrid";
  for (const pugi::xml_node& element : grid.children("Piece")) {
    if (pieces.size() == kMostVtkPieces)
      throw Error(ErrorCode::unsupported, markup.file + ": expected at most 2^16 pieces, found more");
    VtkPiece piece{vtkExtent(markup, element, "Extent")};
    piece.points = vtkXmlArrays(markup, element.child("PointData"), defaults, warn);
    piece.cells = vtkXmlArrays(markup, element.child("CellData"), defaults, warn);
    for (const pugi::xml_node& array : element.child("Coordinates").children("DataArray")) {
      const auto type = vtkXmlType(array.attribute("type").as_string(""));
      if (rectilinear && type) piece.coordinates.push_back(vtkXmlArray(markup, array, defaults, *type));
    }
    if (rectilinear && piece.coordinates.size() != 3)
      throw badVtk(vtkField(markup, "Coordinates"), "3 arrays of numbers",
                   std::to_string(piece.coordinates.size()));
    pieces.push_back(std::move(piece));
  }
}

/// What other types of data sets are called.
std::string_view vtkTypeInWords(std::string_view type) {
  if (type.starts_with('P') && type.size() > 1 && type != "PolyData") type.remove_prefix(1);
  if (type == "UnstructuredGrid") return "unstructured grids cannot be shown yet";
  if (type == "StructuredGrid") return "curved grids cannot be shown yet";
  if (type == "PolyData") return "surfaces cannot be shown yet";
  if (type == "HyperTreeGrid" || type.find("AMR") != std::string_view::npos ||
      type == "vtkHierarchicalBoxDataSet")
    return "grids of several resolutions cannot be shown yet: open their .vti files one by one";
  if (type == "Collection" || type.starts_with("vtk")) return "it is a list of files: open them one by one";
  return "it cannot be shown";
}

/// The element of the grid: ImageData or RectilinearGrid, with P before it if other files hold the pieces.
pugi::xml_node vtkGridElement(const VtkMarkup& markup) {
  const std::string_view type = vtkAttribute(markup, markup.root(), "type");
  static constexpr std::array<std::string_view, 4> kTypes{"ImageData", "RectilinearGrid", "PImageData",
                                                          "PRectilinearGrid"};
  if (std::ranges::find(kTypes, type) == kTypes.end())
    throw Error(ErrorCode::unsupported, markup.file +
                                            ": type: expected ImageData or RectilinearGrid, found " +
                                            inQuotes(type) + "; " + std::string(vtkTypeInWords(type)));
  const pugi::xml_node grid = markup.root().child(std::string(type).c_str());
  if (!grid) throw Error(ErrorCode::badInput, markup.file + ": expected the element " + std::string(type));
  return grid;
}

/// Adds the pieces that other files hold.
void addVtkPieceFiles(const VtkMarkup& markup, const fs::path& path, const pugi::xml_node& grid,
                      VtkDataSet& dataSet, const OpenOptions& options) {
  std::set<fs::path> seen;
  for (const pugi::xml_node& element : grid.children("Piece")) {
    if (options.stop.stop_requested()) throw Error(ErrorCode::cancelled, "loading was cancelled");
    const fs::path file = resolveDataFile(path, "Source", vtkAttribute(markup, element, "Source"));
    if (!seen.insert(file).second) throw badVtk(vtkField(markup, "Source"), "every file once", file.string());
    const VtkMarkup piece(file);
    const pugi::xml_node inside = vtkGridElement(piece);
    if (std::string_view(inside.name()) != std::string_view(grid.name()).substr(1))
      throw badVtk(vtkField(piece, "type"), std::string(grid.name()).substr(1), inside.name());
    addVtkXmlPieces(piece, file, inside, dataSet.pieces, options.warn);
    dataSet.dataFiles.push_back(file);
  }
}

/// The affine of an ImageData's indices: Origin + Direction * (Spacing * index).
glm::dmat4 vtkImageAffine(const VtkMarkup& markup, const pugi::xml_node& grid, const VtkExtent& extent) {
  const auto origin = vtkNumbers<3>(markup, grid, "Origin", {0, 0, 0});
  const auto spacing = vtkNumbers<3>(markup, grid, "Spacing", {1, 1, 1});
  const auto direction = vtkNumbers<9>(markup, grid, "Direction", {1, 0, 0, 0, 1, 0, 0, 0, 1});
  glm::dmat4 m(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto column = std::size_t(axis);
    const bool flat = extent.first[axis] == extent.last[axis];
    const double step = flat && spacing[column] == 0 ? 1 : spacing[column];
    m[axis] = step * glm::dvec4(direction[column], direction[column + 3], direction[column + 6], 0);
    m[3][axis] = origin[column];
  }
  return m;
}

}  // namespace

Match matchVtkXml(const FileStart& start) {
  if (start.folder) return Match::no;
  if (start.bytes.find("<VTKFile") != std::string::npos) return Match::content;
  for (const char* ending : {".vti", ".vtr", ".vtu", ".vts", ".vtp", ".vtm", ".vth", ".pvti", ".pvtr",
                             ".pvtu", ".pvts", ".pvtp"}) {
    if (start.hasEnding(ending)) return Match::name;
  }
  return Match::no;
}

VolumeFile openVtkXml(const fs::path& path, const OpenOptions& options) {
  const VtkMarkup markup(path);
  const pugi::xml_node grid = vtkGridElement(markup);
  const std::string_view type = grid.name();
  VtkDataSet dataSet{path, vtkExtent(markup, grid, "WholeExtent")};
  if (type.ends_with("ImageData")) dataSet.worldFromIndex = vtkImageAffine(markup, grid, dataSet.extent);
  if (type.starts_with('P'))
    addVtkPieceFiles(markup, path, grid, dataSet, options);
  else
    addVtkXmlPieces(markup, path, grid, dataSet.pieces, options.warn);
  return vtkVolumes(std::move(dataSet), options);
}

}  // namespace scolopax::io
