// SPDX-License-Identifier: Apache-2.0
// The text header of a MetaImage file as fields, which meta_image.cpp interprets.
#pragma once
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/core/error.h"

namespace scolopax::io {

class MetaImageHeader {
 public:
  /// Reads at most 1 MiB, up to the field ElementDataFile, which is the last one. Throws Error(badInput) if
  /// there is none, for a line that is no field, and for a field that is there twice.
  explicit MetaImageHeader(const std::filesystem::path& path);

  /// The first of the fields that is there, without surrounding blanks.
  std::optional<std::string_view> find(std::initializer_list<const char*> names) const;
  /// The same, or Error(badInput) if the field is missing.
  std::string_view require(const char* name) const;
  /// The field as `count` finite numbers; none if it is missing. Throws Error(badInput) if it is anything
  /// else.
  std::vector<double> numbers(std::initializer_list<const char*> names, std::size_t count) const;
  /// The field as True or False.
  bool flag(std::initializer_list<const char*> names, bool otherwise) const;
  /// The field as a whole number from `lowest` on.
  std::int64_t integer(const char* name, std::int64_t otherwise, std::int64_t lowest) const;

  /// Errors to throw: file, field, expected, found.
  Error bad(std::string_view field, const std::string& expected, std::string_view found) const;
  Error unsupported(std::string_view field, const std::string& expected, std::string_view found) const;

  std::string file;                   ///< for messages
  std::uint64_t endOffset = 0;        ///< of the byte after the header
  std::vector<std::string> listed{};  ///< the lines after "ElementDataFile = LIST"

 private:
  void addLine(std::string_view line);
  std::map<std::string, std::string, std::less<>> fields_;
};

/// Whether `name` is a field of the format.
bool isMetaImageField(std::string_view name);

}  // namespace scolopax::io
