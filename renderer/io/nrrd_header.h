// SPDX-License-Identifier: Apache-2.0
// The text header of an NRRD file as fields and key/value pairs, which nrrd.cpp interprets.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "renderer/core/error.h"

namespace scolopax::io {

class NrrdHeader {
 public:
  /// Reads at most 1 MiB. Throws Error(badInput) if it is not an NRRD header or has a field twice.
  explicit NrrdHeader(const std::filesystem::path& path);

  /// A field's value without surrounding blanks, by its name in lower case.
  std::optional<std::string_view> find(const std::string& field) const;
  /// The same, or Error(badInput) when the field is missing.
  std::string_view require(const std::string& field) const;
  /// Errors to throw: file, field, expected, found.
  Error bad(std::string_view field, const std::string& expected, std::string_view found) const;
  Error unsupported(std::string_view field, const std::string& expected, std::string_view found) const;

  std::string file;                             ///< for messages
  std::map<std::string, std::string> pairs;     ///< key/value pairs, unescaped
  std::optional<std::uint64_t> attachedOffset;  ///< where the data start, if an empty line ends the header

 private:
  void addLine(std::string_view line);
  std::map<std::string, std::string> fields_;  ///< by name in lower case, without its optional spaces
};

}  // namespace scolopax::io
