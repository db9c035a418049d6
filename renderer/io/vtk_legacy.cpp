// SPDX-License-Identifier: Apache-2.0
// VTK's legacy files (docs.vtk.org, VTK File Formats, "Simple Legacy Formats"): STRUCTURED_POINTS, and
// RECTILINEAR_GRID with even axes, as text or binary.
#include <algorithm>
#include <cmath>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"
#include "renderer/io/vtk_legacy_reader.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kVtkLegacyMagic = "# vtk DataFile Version";

}  // namespace

void VtkLegacyReader::readHeader() {
  const std::string magic = chars_.line();
  if (!magic.starts_with(kVtkLegacyMagic)) throw bad("magic", std::string(kVtkLegacyMagic), magic);
  chars_.line();  // the title
  const std::string coding(chars_.word());
  if (lowerCase(coding) != "ascii" && lowerCase(coding) != "binary")
    throw bad("line 3", "ASCII or BINARY", coding);
  binary_ = lowerCase(coding) == "binary";
  const std::string dataset(chars_.word()), type(chars_.word()), upper = lowerCase(type);
  if (lowerCase(dataset) != "dataset") throw bad("line 4", "DATASET", dataset);
  rectilinear_ = upper == "rectilinear_grid";
  if (rectilinear_ || upper == "structured_points") return;
  const char* why = upper == "unstructured_grid" ? "unstructured grids cannot be shown yet"
                    : upper == "structured_grid" ? "curved grids cannot be shown yet"
                    : upper == "polydata"        ? "surfaces cannot be shown yet"
                                                 : "it cannot be shown";
  throw Error(ErrorCode::unsupported,
              file_ + ": DATASET: expected STRUCTURED_POINTS or RECTILINEAR_GRID, found " + inQuotes(type) +
                  "; " + why);
}

std::uint64_t VtkLegacyReader::countOf(const std::string& where, std::string_view word) const {
  const auto count = parseInteger(word);
  if (!count || *count < 0) throw bad(where, "a whole number", word);
  return std::uint64_t(*count);
}

glm::dvec3 VtkLegacyReader::vectorOf(const std::string& keyword, const Words& words,
                                     const std::string& line) const {
  glm::dvec3 vector(0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = words.size() == 3 ? parseNumber(words[std::size_t(axis)]) : std::nullopt;
    if (!number || !std::isfinite(*number)) throw bad(keyword, "3 finite numbers", line);
    vector[axis] = *number;
  }
  return vector;
}

/// POINT_DATA or CELL_DATA.
void VtkLegacyReader::beginData(const std::string& keyword, const Words& words, const std::string& line) {
  if (!dims_) throw bad(keyword, "DIMENSIONS before it", "none");
  const bool cells = keyword == "cell_data";
  const glm::ivec3 size =
      cells ? glm::ivec3(std::max(dims_->x - 1, 1), std::max(dims_->y - 1, 1), std::max(dims_->z - 1, 1))
            : *dims_;
  tuples_ = scolopax::countOf(size);
  if (words.size() != 1 || countOf(keyword, words[0]) != tuples_)
    throw bad(cells ? "CELL_DATA" : "POINT_DATA", std::to_string(tuples_) + " by DIMENSIONS", line);
  arrays_ = cells ? &piece_.cells : &piece_.points;
}

/// Whether it was a keyword of the grid.
bool VtkLegacyReader::readGeometry(const std::string& keyword, const Words& words, const std::string& line) {
  if (keyword == "dimensions") {
    if (words.size() != 3) throw bad("DIMENSIONS", "3 whole numbers", line);
    const auto size = [&](std::size_t i) { return std::int64_t(countOf("DIMENSIONS", words[i])); };
    dims_ = checkedDims(file_ + ": DIMENSIONS", size(0), size(1), size(2));
    piece_.extent.last = glm::i64vec3(*dims_) - std::int64_t(1);
  } else if (!rectilinear_ && (keyword == "spacing" || keyword == "aspect_ratio")) {
    spacing_ = vectorOf(keyword, words, line);
  } else if (!rectilinear_ && keyword == "origin") {
    origin_ = vectorOf(keyword, words, line);
  } else if (rectilinear_ && keyword.ends_with("_coordinates") && keyword[0] >= 'x' && keyword[0] <= 'z' &&
             keyword[1] == '_') {
    const int axis = keyword[0] - 'x';
    if (words.size() != 2 || !dims_) throw bad(keyword, "a count and a type, and DIMENSIONS before it", line);
    if (countOf(keyword, words[0]) != std::uint64_t((*dims_)[axis]))
      throw bad(keyword, std::to_string((*dims_)[axis]) + " by DIMENSIONS", words[0]);
    coordinates_[std::size_t(axis)] = array(keyword, words[1], 1, std::uint64_t((*dims_)[axis]));
  } else {
    return false;
  }
  if (arrays_) throw bad(keyword, "it before POINT_DATA and CELL_DATA", "it behind them");
  return true;
}

void VtkLegacyReader::readKeyword(const std::string& keyword, const std::string& line) {
  const Words words = splitWords(line);
  if (keyword == "point_data" || keyword == "cell_data")
    beginData(keyword, words, line);
  else if (keyword == "field")
    readFieldArrays(words, line);
  else if (keyword == "metadata")
    skipMetadata();
  else if (!readGeometry(keyword, words, line))
    readAttribute(keyword, words, line);
}

VtkDataSet VtkLegacyReader::read() {
  readHeader();
  for (std::string keyword = lowerCase(chars_.word()); !keyword.empty(); keyword = lowerCase(chars_.word()))
    readKeyword(keyword, chars_.line());
  if (!dims_) throw Error(ErrorCode::badInput, file_ + ": DIMENSIONS: is missing");
  VtkDataSet dataSet{path_, piece_.extent};
  for (int axis = 0; axis < 3; ++axis) {
    const auto& coordinates = coordinates_[std::size_t(axis)];
    if (rectilinear_ && !coordinates)
      throw Error(ErrorCode::badInput, file_ + ": " + "XYZ"[axis] + "_COORDINATES: is missing");
    if (rectilinear_) piece_.coordinates.push_back(*coordinates);
    const bool flat = (*dims_)[axis] == 1 && spacing_[axis] == 0;
    dataSet.worldFromIndex[axis][axis] = flat ? 1 : spacing_[axis];
    dataSet.worldFromIndex[3][axis] = origin_[axis];
  }
  dataSet.pieces.push_back(std::move(piece_));
  return dataSet;
}

Match matchVtkLegacy(const FileStart& start) {
  if (start.bytes.starts_with(kVtkLegacyMagic)) return Match::content;
  return start.hasEnding(".vtk") && !start.folder ? Match::name : Match::no;
}

VolumeFile openVtkLegacy(const fs::path& path, const OpenOptions& options) {
  return vtkVolumes(VtkLegacyReader(path, options.warn).read(), options);
}

}  // namespace scolopax::io
