// SPDX-License-Identifier: Apache-2.0
// The XML of a VTK file without its data: texts, which may be gigabytes of numbers, are left where they are,
// and only their positions are kept. Between VtkChars and vtk_xml.cpp.
#pragma once
#include <cstdint>
#include <filesystem>
#include <pugixml.hpp>
#include <string>

namespace scolopax::io {

/// Bytes of a file.
struct VtkText {
  std::uint64_t begin = 0, end = 0;
};

class VtkMarkup {
 public:
  /// Reads the file up to <AppendedData>, behind whose '_' it is no XML. Throws Error(badInput) unless that
  /// is XML with the element VTKFile, Error(unsupported) beyond 16 MiB of tags.
  explicit VtkMarkup(const std::filesystem::path& path);

  pugi::xml_node root() const { return document_.child("VTKFile"); }
  /// Where the text of an element is; empty if it has none.
  static VtkText textOf(const pugi::xml_node& element);
  /// The bytes behind the '_' of AppendedData; empty if there is none.
  const VtkText& appended() const { return appended_; }

  std::string file;  ///< for messages

 private:
  pugi::xml_document document_;
  VtkText appended_;
};

}  // namespace scolopax::io
