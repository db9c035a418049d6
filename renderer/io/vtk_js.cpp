// SPDX-License-Identifier: Apache-2.0
// The folders of vtk.js (its HttpDataSetReader): index.json describes an image, and each array is a file of
// bytes, which may be packed by gzip.
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/vtk_dataset.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

using VtkJson = nlohmann::json;

constexpr const char* kVtkJsIndex = "index.json";

std::optional<StoredType> vtkJsType(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, StoredType>, 8> kTypes{
      {{"Int8Array", StoredType::i8},
       {"Uint8Array", StoredType::u8},
       {"Int16Array", StoredType::i16},
       {"Uint16Array", StoredType::u16},
       {"Int32Array", StoredType::i32},
       {"Uint32Array", StoredType::u32},
       {"Float32Array", StoredType::f32},
       {"Float64Array", StoredType::f64}}};
  const auto found = std::ranges::find(kTypes, name, &std::pair<std::string_view, StoredType>::first);
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

/// A member of an object; null if there is none.
const VtkJson& vtkMember(const VtkJson& object, const char* key) {
  static const VtkJson kNull;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found == object.end() ? kNull : *found;
}

std::string vtkText(const VtkJson& object, const char* key) {
  const VtkJson& value = vtkMember(object, key);
  return value.is_string() ? value.get<std::string>() : std::string();
}

/// N finite numbers, or `otherwise` if there is no such member.
template <std::size_t N>
std::array<double, N> vtkJsNumbers(const std::string& file, const VtkJson& object, const char* key,
                                   std::array<double, N> otherwise) {
  const VtkJson& value = vtkMember(object, key);
  if (value.is_null()) return otherwise;
  bool good = value.is_array() && value.size() == N;
  for (std::size_t i = 0; good && i < N; ++i) {
    good = value[i].is_number() && std::isfinite(value[i].get<double>());
    if (good) otherwise[i] = value[i].get<double>();
  }
  if (!good)
    throw Error(ErrorCode::badInput, file + ": " + key + ": expected " + std::to_string(N) + " numbers");
  return otherwise;
}

VtkExtent vtkJsExtent(const std::string& file, const VtkJson& root) {
  constexpr double kFarthest = 0x1p31;
  if (vtkMember(root, "extent").is_null()) throw Error(ErrorCode::badInput, file + ": extent: is missing");
  const auto numbers = vtkJsNumbers<6>(file, root, "extent", {});
  VtkExtent extent;
  for (int i = 0; i < 6; ++i) {
    const double number = numbers[std::size_t(i)];
    if (number != std::floor(number) || std::abs(number) > kFarthest)
      throw Error(ErrorCode::badInput, file + ": extent: expected whole numbers");
    (i % 2 == 0 ? extent.first : extent.last)[i / 2] = std::int64_t(number);
  }
  return extent;
}

VtkArray vtkJsArray(const std::string& file, const fs::path& index, const VtkJson& data) {
  VtkArray array{.file = file, .name = vtkText(data, "name")};
  const auto type = vtkJsType(vtkText(data, "dataType"));
  if (!type) throw unsupportedVtk(array.where(), "a dataType such as Int16Array", vtkText(data, "dataType"));
  array.type = *type;
  const VtkJson &components = vtkMember(data, "numberOfComponents"), &ref = vtkMember(data, "ref");
  if (!components.is_null() && !components.is_number_unsigned())
    throw Error(ErrorCode::badInput, array.where() + ": numberOfComponents: expected a number");
  const std::uint64_t count = components.is_null() ? 1 : components.get<std::uint64_t>();
  if (count < 1 || count > 4096)
    throw unsupportedVtk(array.where(), "numberOfComponents from 1 to 4096", std::to_string(count));
  array.components = std::size_t(count);
  const std::string order = vtkText(ref, "encode"), folder = vtkText(ref, "basepath");
  if (order != "LittleEndian" && order != "BigEndian")
    throw unsupportedVtk(array.where(), "encode of LittleEndian or BigEndian", order);
  array.bigEndian = order == "BigEndian";
  const std::string name = (folder.empty() ? "" : folder + "/") + vtkText(ref, "id");
  array.path = resolveDataFile(index, "ref", name, ".gz");
  array.gzip = true;
  array.end = ByteStream(array.path, ByteStream::Encoding::detect).largestSize();
  return array;
}

std::vector<VtkArray> vtkJsArrays(const std::string& file, const fs::path& index, const VtkJson& data) {
  constexpr std::size_t kMostArrays = 4096;
  std::vector<VtkArray> arrays;
  for (const VtkJson& element : vtkMember(data, "arrays")) {
    if (arrays.size() == kMostArrays)
      throw Error(ErrorCode::unsupported, file + ": expected at most 4096 arrays, found more");
    arrays.push_back(vtkJsArray(file, index, vtkMember(element, "data")));
  }
  return arrays;
}

VtkJson vtkJsIndex(const fs::path& path) {
  constexpr std::size_t kLongest = 1 << 20;
  ByteStream stream(path, ByteStream::Encoding::plain);
  std::string text(kLongest + 1, '\0');
  text.resize(stream.readSome(std::as_writable_bytes(std::span(text))));
  if (text.size() > kLongest)
    throw Error(ErrorCode::unsupported, shown(path) + ": expected at most 1 MiB, found more");
  VtkJson root = VtkJson::parse(text, nullptr, false);
  if (!root.is_object())
    throw Error(ErrorCode::badInput, shown(path) + ": expected JSON, found something else");
  return root;
}

/// The columns of the matrix follow one another, other than in VTK's XML.
glm::dmat4 vtkJsAffine(const std::string& file, const VtkJson& root) {
  const auto origin = vtkJsNumbers<3>(file, root, "origin", {0, 0, 0});
  const auto spacing = vtkJsNumbers<3>(file, root, "spacing", {1, 1, 1});
  const auto direction = vtkJsNumbers<9>(file, root, "direction", {1, 0, 0, 0, 1, 0, 0, 0, 1});
  glm::dmat4 m(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = std::size_t(axis);
    m[axis] = spacing[i] * glm::dvec4(direction[3 * i], direction[3 * i + 1], direction[3 * i + 2], 0);
    m[3][axis] = origin[i];
  }
  return m;
}

}  // namespace

Match matchVtkJs(const FileStart& start) {
  if (!start.contains(kVtkJsIndex)) return Match::no;
  try {
    ByteStream stream(start.path / kVtkJsIndex, ByteStream::Encoding::plain);
    std::string text(4096, '\0');
    text.resize(stream.readSome(std::as_writable_bytes(std::span(text))));
    return text.find("\"vtkClass\"") == std::string::npos ? Match::no : Match::content;
  } catch (const Error&) {  // not a file that can be read
    return Match::no;
  }
}

VolumeFile openVtkJs(const fs::path& path, const OpenOptions& options) {
  const fs::path index = path / kVtkJsIndex;
  const std::string file = shown(index);
  const VtkJson root = vtkJsIndex(index);
  if (const std::string type = vtkText(root, "vtkClass"); type != "vtkImageData")
    throw unsupportedVtk(file + ": vtkClass", "vtkImageData", type);
  VtkDataSet dataSet{path, vtkJsExtent(file, root), vtkJsAffine(file, root)};
  VtkPiece piece{dataSet.extent};
  piece.points = vtkJsArrays(file, index, vtkMember(root, "pointData"));
  piece.cells = vtkJsArrays(file, index, vtkMember(root, "cellData"));
  for (const auto* arrays : {&piece.points, &piece.cells})
    for (const VtkArray& array : *arrays) dataSet.dataFiles.push_back(array.path);
  dataSet.pieces.push_back(std::move(piece));
  return vtkVolumes(std::move(dataSet), options);
}

}  // namespace scolopax::io
