// SPDX-License-Identifier: Apache-2.0
// The keywords of a legacy VTK file, from its first line to its last one. vtk_legacy.cpp reads what describes
// the grid, vtk_legacy_arrays.cpp what describes arrays.
#pragma once
#include <array>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/io/vtk_dataset.h"

namespace scolopax::io {

/// Goes through a file once, and notes where its arrays are.
class VtkLegacyReader {
 public:
  VtkLegacyReader(const std::filesystem::path& path, const Warn& warn)
      : path_(path), file_(shown(path)), warn_(warn), chars_(path) {}

  /// Throws Error(badInput) for what the format forbids, Error(unsupported) for grids that are not regular.
  VtkDataSet read();

 private:
  using Words = std::vector<std::string_view>;

  void readHeader();
  void readKeyword(const std::string& keyword, const std::string& line);
  bool readGeometry(const std::string& keyword, const Words& words, const std::string& line);
  void readAttribute(const std::string& keyword, const Words& words, const std::string& line);
  void readFieldArrays(const Words& words, const std::string& line);
  void beginData(const std::string& keyword, const Words& words, const std::string& line);
  void skipMetadata();
  void skipStrings(std::uint64_t count);
  glm::dvec3 vectorOf(const std::string& keyword, const Words& words, const std::string& line) const;
  std::uint64_t countOf(const std::string& where, std::string_view word) const;
  /// The array whose numbers are next; they are skipped.
  VtkArray array(std::string_view name, std::string_view typeName, std::size_t components,
                 std::uint64_t tuples);
  void keep(VtkArray array);
  Error bad(const std::string& field, const std::string& expected, std::string_view found) const {
    return badVtk(file_ + ": " + field, expected, found);
  }

  const std::filesystem::path path_;
  const std::string file_;
  const Warn& warn_;
  VtkChars chars_;
  bool binary_ = false, rectilinear_ = false;
  std::optional<glm::ivec3> dims_;
  glm::dvec3 spacing_{1}, origin_{0};
  std::vector<VtkArray>* arrays_ = nullptr;  ///< of points or of cells, once their data have begun
  std::uint64_t tuples_ = 0;
  VtkPiece piece_;
  std::array<std::optional<VtkArray>, 3> coordinates_;
};

}  // namespace scolopax::io
